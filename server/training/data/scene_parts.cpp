#include "server/training/data/scene_parts.h"

#include <cmath>
#include <numbers>

namespace gatefield::training {

using Eigen::AngleAxisd;
using Eigen::Isometry3d;
using Eigen::Vector3d;

namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

Isometry3d gate_pose(const Vector3d& p, double yaw, Random* random) {
  const double limit = (random->chance(0.15) ? 40.0 : 10.0) * kDegree;
  // Squared, so that small tilts are the usual ones.
  const auto tilt = [&] { return limit * random->uniform() * random->uniform(-1.0, 1.0); };
  const double pitch = tilt();
  return pose(p, yaw, pitch, tilt());
}

}  // namespace

Isometry3d pose(const Vector3d& p, double yaw, double pitch, double roll) {
  Isometry3d X = Isometry3d::Identity();
  X.linear() =
      (AngleAxisd(yaw, Vector3d::UnitZ()) * AngleAxisd(pitch, Vector3d::UnitY()) * AngleAxisd(roll, Vector3d::UnitX()))
          .toRotationMatrix();
  X.translation() = p;
  return X;
}

scene::Gate make_gate(const Vector3d& p_WG, double yaw, Random* random) {
  scene::Gate gate;
  gate.X_WG = gate_pose(p_WG, yaw, random);
  gate.shape.thickness_m = random->uniform(0.03, 0.10);
  gate.reflectance = static_cast<float>(random->uniform(0.15, 0.95));
  return gate;
}

scene::Box upright_box(const Vector3d& p_W, double yaw, const Vector3d& half_m, Random* random) {
  return {
      .X_WO = pose(p_W, yaw, 0, 0), .half_m = half_m, .reflectance = static_cast<float>(random->uniform(0.05, 0.95))};
}

double distance_m(const scene::Box& box, const Vector3d& p_W) {
  const Vector3d p_O = box.X_WO.inverse() * p_W;
  return (p_O.cwiseAbs() - box.half_m).cwiseMax(0.0).norm();
}

bool blocks(const scene::Box& box, const scene::Gate& gate) {
  const double reach_m = gate.shape.inner_half_m;
  if ((box.X_WO.translation() - gate.X_WG.translation()).norm() > box.half_m.norm() + 2.0 * reach_m) return false;
  for (int ix = -1; ix <= 1; ++ix) {
    for (int iy = -1; iy <= 1; ++iy) {
      for (int iz = -1; iz <= 1; ++iz) {
        const Vector3d p_G(0.5 * ix, reach_m * iy, reach_m * iz);
        if (distance_m(box, gate.X_WG * p_G) < 0.25) return true;
      }
    }
  }
  return false;
}

void add_stand(const scene::Gate& gate, double floor_z_m, Random* random, std::vector<scene::Box>* boxes) {
  const double outer_m = gate.shape.outer_half_m;
  const bool two_legs = random->chance(0.6);
  const bool feet = random->chance(0.5);
  const double half_width_m = random->uniform(0.015, 0.05);
  const auto reflectance = random->chance(0.7) ? gate.reflectance : static_cast<float>(random->uniform(0.05, 0.95));
  const double yaw = std::atan2(gate.X_WG.linear()(1, 0), gate.X_WG.linear()(0, 0));
  const double leg_y_m = two_legs ? outer_m - random->uniform(0.03, 0.25) : 0.0;
  for (const double side : {1.0, -1.0}) {
    const double lower_edge_m =
        gate.shape.opening == GateShape::Opening::kRound ? std::sqrt(outer_m * outer_m - leg_y_m * leg_y_m) : outer_m;
    const Vector3d top_W = gate.X_WG * Vector3d(0, side * leg_y_m, -lower_edge_m + 0.02);
    const double height_m = top_W.z() - floor_z_m;
    if (height_m > 0.05) {
      scene::Box leg{.X_WO = pose({top_W.x(), top_W.y(), floor_z_m + 0.5 * height_m}, yaw, 0, 0),
                     .half_m = {half_width_m, half_width_m, 0.5 * height_m},
                     .reflectance = reflectance};
      boxes->push_back(leg);
      if (feet) {
        boxes->push_back({.X_WO = pose({top_W.x(), top_W.y(), floor_z_m + 0.02}, yaw, 0, 0),
                          .half_m = {random->uniform(0.1, 0.4), random->uniform(0.03, 0.1), 0.02},
                          .reflectance = reflectance});
      }
    }
    if (!two_legs) break;
  }
}

std::vector<scene::Box> person_boxes(const Vector3d& p_W, double yaw, Random* random) {
  const double height_m = random->uniform(1.5, 1.95);
  const auto reflectance = static_cast<float>(random->uniform(0.05, 0.8));
  std::vector<scene::Box> boxes;
  const auto part = [&](double low, double high, double half_x_m, double half_y_m) {
    boxes.push_back({.X_WO = pose(p_W + Vector3d(0, 0, 0.5 * (low + high) * height_m), yaw, 0, 0),
                     .half_m = {half_x_m, half_y_m, 0.5 * (high - low) * height_m},
                     .reflectance = reflectance});
  };
  part(0.0, 0.48, 0.09, 0.15);
  part(0.48, 0.84, 0.12, 0.23);
  part(0.86, 1.0, 0.10, 0.08);
  return boxes;
}

}  // namespace gatefield::training
