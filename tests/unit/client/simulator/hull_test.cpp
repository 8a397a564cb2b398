#include "client/simulator/hull.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "common/base/random.h"

namespace gatefield::simulator {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();

Eigen::Vector3d anywhere(Random* random, double size_m) {
  return {random->uniform(-size_m, size_m), random->uniform(-size_m, size_m), random->uniform(-size_m, size_m)};
}

Eigen::Quaterniond any_turn(Random* random) {
  return Eigen::Quaterniond(random->normal(), random->normal(), random->normal(), random->normal()).normalized();
}

scene::Box any_box(Random* random) {
  scene::Box box;
  box.X_WO = Eigen::Translation3d(anywhere(random, 0.5)) * any_turn(random);
  box.half_m = {random->uniform(0.01, 0.8), random->uniform(0.01, 0.3), random->uniform(0.01, 0.3)};
  return box;
}

Disc any_disc(Random* random, double size_m) {
  return {anywhere(random, size_m), any_turn(random) * Eigen::Vector3d::UnitZ(), random->uniform(0.02, 0.4)};
}

/// The nearest over a fine polar grid of the disc: at least the true distance, and at most half a cell's diagonal more.
double by_grid(const Disc& disc, const scene::Box& box) {
  constexpr int kRings = 60, kRays = 360;
  const Eigen::Vector3d u = disc.normal.unitOrthogonal(), v = disc.normal.cross(u);
  double nearest_m = kInfinite;
  for (int ring = 0; ring <= kRings; ++ring)
    for (int ray = 0; ray < kRays; ++ray) {
      const double r_m = disc.radius_m * ring / kRings, angle = 2.0 * std::numbers::pi * ray / kRays;
      const Eigen::Vector3d q_W = disc.center_m + r_m * (std::cos(angle) * u + std::sin(angle) * v);
      nearest_m = std::min(nearest_m, distance(q_W, box));
    }
  return nearest_m;
}

/// How far apart a plane with that normal keeps disc and box: never more than their distance, whatever the normal.
double apart_along(const Eigen::Vector3d& n_W, const Disc& disc, const scene::Box& box) {
  const Eigen::Vector3d n_O = box.X_WO.linear().transpose() * n_W;
  const double box_reach_m = n_W.dot(box.X_WO.translation()) + n_O.cwiseAbs().dot(box.half_m);
  return n_W.dot(disc.center_m) - disc.radius_m * n_W.cross(disc.normal).norm() - box_reach_m;
}

/// The best of those planes, found from many beginnings by ever smaller steps: a lower bound that owes nothing to the
/// search along chords.
double by_planes(const Disc& disc, const scene::Box& box, Random* random) {
  double best_m = -kInfinite;
  for (int begin = 0; begin < 40; ++begin) {
    Eigen::Vector3d n_W = any_turn(random) * Eigen::Vector3d::UnitX();
    if (begin == 0) n_W = (disc.center_m - box.X_WO.translation()).normalized();
    double here_m = apart_along(n_W, disc, box);
    for (double step = 0.5; step > 1e-8; step *= 0.8)
      for (int attempt = 0; attempt < 6; ++attempt) {
        const Eigen::Vector3d other_W = (n_W + step * anywhere(random, 1.0)).normalized();
        const double there_m = apart_along(other_W, disc, box);
        if (there_m <= here_m) continue;
        here_m = there_m;
        n_W = other_W;
      }
    best_m = std::max(best_m, here_m);
  }
  return best_m;
}

TEST(DiscAndBox, AreAsFarApartAsAnyPointOfTheDiscAndAnyPlaneBetweenThemSay) {
  Random random(7);
  int apart = 0;
  for (int i = 0; i < 300; ++i) {
    const scene::Box box = any_box(&random);
    const Disc disc = any_disc(&random, 1.2);
    const double found_m = distance(disc, box), grid_m = by_grid(disc, box);
    const double cell_m = std::hypot(0.5 * disc.radius_m / 60, disc.radius_m * std::numbers::pi / 360);
    EXPECT_LE(found_m, grid_m) << i;
    EXPECT_GE(found_m, grid_m - cell_m - kHullError_m) << i;
    if (found_m < 0.0) continue;
    ++apart;
    const double planes_m = by_planes(disc, box, &random);
    EXPECT_LE(planes_m, found_m + kHullError_m + 1e-12) << i << ": above the true distance by less than the error";
    EXPECT_GE(planes_m, found_m - 1e-4) << i;
  }
  EXPECT_GT(apart, 150);
}

// A post's face at x = 0, its edge along z at y = 0; the disc's lowest point is known.
scene::Box post() { return {Eigen::Isometry3d(Eigen::Translation3d(0.5, 0.5, 0.0)), {0.5, 0.5, 2.0}}; }

TEST(DiscAndBox, TiltedAgainstAFaceTheRimIsNearest) {
  for (const double tilt : {0.0, 0.3, 1.0, std::numbers::pi / 2}) {
    const Disc disc{{-0.5, 0.4, 0.1}, {std::sin(tilt), 0.0, std::cos(tilt)}, 0.2};
    const double true_m = 0.5 - 0.2 * std::cos(tilt);
    EXPECT_LE(distance(disc, post()), true_m + 1e-12) << tilt;
    EXPECT_GE(distance(disc, post()), true_m - kHullError_m - 1e-12) << tilt;
  }
}

TEST(DiscAndBox, GrazeExactly) {
  // In the plane z = 0 with the corner of the post's section at the origin: nearest along the diagonal.
  const double half = std::numbers::sqrt2 / 2;
  for (const double gap_m : {1e-5, 1e-3, 0.1}) {
    const Disc beside{{-(0.2 + gap_m) * half, -(0.2 + gap_m) * half, 0.0}, Eigen::Vector3d::UnitZ(), 0.2};
    EXPECT_NEAR(distance(beside, post()), gap_m, 1.1 * kHullError_m);
    // Flat against the face, beside it in y by the gap: the rim's own tangent runs along the edge.
    const Disc flat{{0.3, -0.2 - gap_m, 0.0}, Eigen::Vector3d::UnitX(), 0.2};
    EXPECT_NEAR(distance(flat, post()), gap_m, 1.1 * kHullError_m);
  }
  const Disc touching{{-0.2 * half + 1e-6, -0.2 * half + 1e-6, 0.0}, Eigen::Vector3d::UnitZ(), 0.2};
  EXPECT_LT(distance(touching, post()), 0.0);
}

TEST(DiscAndBox, TouchWithoutAnyEdgeOfTheBoxInTheDisc) {
  const scene::Box slab{Eigen::Isometry3d::Identity(), {1.0, 1.0, 0.1}};
  EXPECT_LT(distance({{0, 0, 0.15}, Eigen::Vector3d::UnitX(), 0.06}, slab), 0.0) << "the rim dips into a face";
  EXPECT_GT(distance({{0, 0, 0.15}, Eigen::Vector3d::UnitX(), 0.04}, slab), 0.0);
  EXPECT_LT(distance({{0, 0, 0}, Eigen::Vector3d::UnitZ(), 0.05}, slab), 0.0) << "all of it inside";
  const scene::Box pin{Eigen::Isometry3d::Identity(), {0.001, 0.001, 0.5}};
  EXPECT_LT(distance({{0.1, 0, 0}, Eigen::Vector3d::UnitZ(), 0.2}, pin), 0.0) << "a pin through the disc";
  EXPECT_NEAR(distance({{0.1, 0, 0.6}, Eigen::Vector3d::UnitZ(), 0.2}, pin), 0.1, 2 * kHullError_m);
}

TEST(Hull, OfTheRacerHasItsTipsAt17Centimetres) {
  const config::Vehicle racer;
  const Hull discs = hull_of(racer, config::HullKind::kDiscs), sphere = hull_of(racer, config::HullKind::kSphere);
  EXPECT_EQ(discs.disc_count, 4u);
  EXPECT_NEAR(discs.reach_m(), 0.17, 5e-4);
  EXPECT_EQ(sphere.disc_count, 0u);
  EXPECT_EQ(sphere.reach_m(), racer.quadrotor.collision_radius_m);
}

TEST(Hull, IsTurnedWithTheVehicleAgainstAFramesEdge) {
  const Hull hull = hull_of(config::Vehicle(), config::HullKind::kDiscs);
  const auto from_post = [&](const Eigen::Quaterniond& q_WB) {
    return PlacedHull(hull, {-1.0, 0.4, 0.0}, q_WB).nearest_m(post(), kInfinite);
  };
  EXPECT_NEAR(from_post(Eigen::Quaterniond::Identity()), 1.0 - 0.0771 - 0.061, 2e-6);
  const Eigen::Quaterniond yawed(Eigen::AngleAxisd(std::numbers::pi / 4, Eigen::Vector3d::UnitZ()));
  EXPECT_NEAR(from_post(yawed), 1.0 - hull.reach_m(), 2e-6);
  const Eigen::Quaterniond pitched(Eigen::AngleAxisd(1.2, Eigen::Vector3d::UnitY()));
  EXPECT_NEAR(from_post(pitched), 1.0 - 0.13, 2e-6) << "the discs stand upright, the body is nearest";
  const double part = std::cos(0.2);
  const Eigen::Quaterniond leant(Eigen::AngleAxisd(0.2, Eigen::Vector3d::UnitY()));
  EXPECT_NEAR(from_post(leant), 1.0 - part * (0.0771 + 0.061), 2e-6);
}

TEST(Hull, OfDiscsIsNeverFartherThanTheSphereAlone) {
  const Hull discs = hull_of(config::Vehicle(), config::HullKind::kDiscs);
  const Hull sphere = hull_of(config::Vehicle(), config::HullKind::kSphere);
  Random random(3);
  int nearer = 0;
  for (int i = 0; i < 500; ++i) {
    const scene::Box box = any_box(&random);
    const Eigen::Vector3d p_WB = anywhere(&random, 1.0);
    const Eigen::Quaterniond q_WB = any_turn(&random);
    const double by_discs_m = PlacedHull(discs, p_WB, q_WB).nearest_m(box, kInfinite);
    const double by_sphere_m = PlacedHull(sphere, p_WB, q_WB).nearest_m(box, kInfinite);
    EXPECT_LE(by_discs_m, by_sphere_m);
    EXPECT_GE(by_discs_m, by_sphere_m - 0.04 - kHullError_m);
    nearer += by_discs_m < by_sphere_m;
    // A limit only saves work.
    EXPECT_EQ(PlacedHull(discs, p_WB, q_WB).nearest_m(box, 0.3), std::min(0.3, by_discs_m));
  }
  EXPECT_GT(nearer, 100);
}

TEST(Hull, KnowsTheHeightOfItsTips) {
  const Hull discs = hull_of(config::Vehicle(), config::HullKind::kDiscs);
  const Eigen::Quaterniond rolled(Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitX()));
  EXPECT_NEAR(PlacedHull(discs, {0, 0, 1}, rolled).discs_above_m(0.25), 0.75 - std::sin(0.5) * (0.0771 + 0.061), 1e-9);
  EXPECT_EQ(PlacedHull(Hull(), {0, 0, 1}, rolled).discs_above_m(0.25), kInfinite);
}

}  // namespace
}  // namespace gatefield::simulator
