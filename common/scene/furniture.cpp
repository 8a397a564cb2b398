#include "common/scene/furniture.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace gatefield::scene {
namespace {

constexpr double kFloorPerTry_m2 = 6.0;
constexpr double kWall_m = 0.1;  // thickness
constexpr double kApart_m = 0.3;

/// One thing, standing on the floor at the origin: parts with their centres in `X_WO`.
using Thing = std::vector<Box>;

Box part(const Eigen::Vector3d& size_m, const Eigen::Vector3d& foot_m, Reflectance reflectance) {
  Box box;
  box.half_m = 0.5 * size_m;
  box.X_WO.translation() = foot_m + Eigen::Vector3d(0, 0, box.half_m.z());
  box.reflectance = reflectance;
  return box;
}

Thing table(Reflectance reflectance) {
  Thing thing{part({1.6, 0.8, 0.04}, {0, 0, 0.70}, reflectance)};
  for (const double x_m : {-0.75, 0.75})
    for (const double y_m : {-0.35, 0.35}) thing.push_back(part({0.05, 0.05, 0.70}, {x_m, y_m, 0}, reflectance));
  return thing;
}

/// @param size  1: 1.75 m tall
Thing person(double size, Reflectance reflectance) {
  return {part(size * Eigen::Vector3d(0.15, 0.15, 0.85), size * Eigen::Vector3d(0, -0.11, 0), reflectance),
          part(size * Eigen::Vector3d(0.15, 0.15, 0.85), size * Eigen::Vector3d(0, 0.11, 0), reflectance),
          part(size * Eigen::Vector3d(0.25, 0.45, 0.62), size * Eigen::Vector3d(0, 0, 0.85), reflectance),
          part(size * Eigen::Vector3d(0.20, 0.17, 0.28), size * Eigen::Vector3d(0, 0, 1.47), reflectance)};
}

Thing draw(double room_height_m, Random* random) {
  const auto reflectance = static_cast<Reflectance>(random->uniform(0.2, 0.9));
  switch (random->below(5)) {
    case 0: {
      const double width_m = random->uniform(0.3, 0.6);
      return {part({width_m, width_m, room_height_m}, Eigen::Vector3d::Zero(), reflectance)};
    }
    case 1:
      return table(reflectance);
    case 2: {
      const double x_m = random->uniform(0.4, 1.0), y_m = random->uniform(0.4, 1.0), z_m = random->uniform(0.3, 1.2);
      return {part({x_m, y_m, z_m}, Eigen::Vector3d::Zero(), reflectance)};
    }
    case 3: {
      const double length_m = random->uniform(1.0, 3.0);
      return {part({length_m, kWall_m, 2.2}, Eigen::Vector3d::Zero(), reflectance)};
    }
    default:
      return person(random->uniform(0.9, 1.1), reflectance);
  }
}

/// Of the circle about the origin that everything stands in.
double footprint_m(const Thing& thing) {
  double radius_m = 0.0;
  for (const Box& box : thing)
    radius_m = std::max(radius_m, box.X_WO.translation().head<2>().norm() + box.half_m.head<2>().norm());
  return radius_m;
}

std::vector<Box> walls(const Eigen::AlignedBox3d& room) {
  std::vector<Box> boxes;
  const Eigen::Vector3d middle = room.center(), half_m = 0.5 * room.sizes();
  for (const int axis : {0, 1})
    for (const double side : {-1.0, 1.0}) {
      Box box;
      box.half_m = half_m;
      box.half_m[axis] = 0.5 * kWall_m;
      box.X_WO.translation() = middle;
      box.X_WO.translation()[axis] += side * (half_m[axis] + 0.5 * kWall_m);
      boxes.push_back(box);
    }
  return boxes;
}

}  // namespace

std::vector<Box> furnish(const Hall& hall, Random* random) {
  struct Place {
    Eigen::Vector2d p_W;
    double radius_m;
  };
  std::vector<Place> taken;
  std::vector<Box> boxes = walls(hall.room);
  const Eigen::Vector3d low = hall.room.min(), sizes_m = hall.room.sizes();
  const auto tries = static_cast<int>(sizes_m.x() * sizes_m.y() / kFloorPerTry_m2);
  for (int i = 0; i < tries; ++i) {
    const Eigen::Vector2d p_W(low.x() + sizes_m.x() * random->uniform(), low.y() + sizes_m.y() * random->uniform());
    const Eigen::AngleAxisd turn(random->uniform(0.0, 2.0 * std::numbers::pi), Eigen::Vector3d::UnitZ());
    const Thing thing = draw(sizes_m.z(), random);
    const double radius_m = footprint_m(thing);
    const bool on_the_way = std::any_of(hall.way_W.begin(), hall.way_W.end(), [&](const Eigen::Vector3d& way_W) {
      return (way_W.head<2>() - p_W).norm() < hall.clear_m + radius_m;
    });
    const bool in_another = std::any_of(taken.begin(), taken.end(), [&](const Place& place) {
      return (place.p_W - p_W).norm() < place.radius_m + radius_m + kApart_m;
    });
    if (on_the_way || in_another) continue;
    taken.push_back({p_W, radius_m});
    const Eigen::Isometry3d X_WT = Eigen::Translation3d(p_W.x(), p_W.y(), low.z()) * turn;
    for (Box box : thing) {
      box.X_WO = X_WT * box.X_WO;
      boxes.push_back(box);
    }
  }
  return boxes;
}

}  // namespace gatefield::scene
