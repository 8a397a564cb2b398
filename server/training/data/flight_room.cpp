#include "server/training/data/flight_room.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "server/training/data/scene_parts.h"

namespace gatefield::training {
namespace {

using Eigen::Vector3d;

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr std::uint64_t kRoomStream = std::uint64_t{1} << 48;  ///< Random(seed, stream + number); flights.cpp has more

std::vector<Station> draw_course(Random* random) {
  const std::uint32_t count = 3 + random->below(4);
  const double which = random->uniform();
  const double sense = random->chance(0.5) ? 1.0 : -1.0;
  const double height_m = random->uniform(0.9, 1.8);
  std::vector<Station> course(count);
  if (which < 0.4) {  // a circle
    const double radius_m = random->uniform(std::max(3.2, 0.55 * count), 6.0);
    for (std::uint32_t k = 0; k < count; ++k) {
      const double angle = sense * (2.0 * std::numbers::pi * k / count + random->uniform(-0.15, 0.15));
      course[k].p_W = {radius_m * std::cos(angle), radius_m * std::sin(angle), height_m};
      course[k].yaw = angle + sense * 0.5 * std::numbers::pi;
    }
  } else if (which < 0.7) {  // an eight, its crossing left free
    const double half_length_m = random->uniform(5.0, 8.0);
    const double half_width_m = random->uniform(2.8, 4.5);
    for (std::uint32_t k = 0; k < count; ++k) {
      // Both loops in turn, 0.6 to 2.5 rad after the crossing.
      const std::uint32_t on_first = (count + 1) / 2;
      const bool first = k < on_first;
      const double place = first ? (k + 0.5) / on_first : (k - on_first + 0.5) / (count - on_first);
      const double t = (first ? 0.0 : std::numbers::pi) + 0.55 + place * (std::numbers::pi - 1.1);
      course[k].p_W = {half_length_m * std::sin(t), sense * half_width_m * std::sin(2.0 * t), height_m};
      course[k].yaw = std::atan2(sense * 2.0 * half_width_m * std::cos(2.0 * t), half_length_m * std::cos(t));
    }
  } else {  // anywhere around the middle
    for (std::uint32_t k = 0; k < count; ++k) {
      const double angle = sense * 2.0 * std::numbers::pi * (k + random->uniform(-0.3, 0.3)) / count;
      const double radius_m = random->uniform(2.8, 7.0);
      course[k].p_W = {radius_m * std::cos(angle), radius_m * std::sin(angle), height_m};
    }
    for (std::uint32_t k = 0; k < count; ++k) {
      const Vector3d from_to_W = course[(k + 1) % count].p_W - course[(k + count - 1) % count].p_W;
      course[k].yaw = std::atan2(from_to_W.y(), from_to_W.x());
    }
  }
  for (Station& station : course) station.p_W.z() += random->uniform(-0.15, 0.5);
  return course;
}

}  // namespace

std::vector<scene::Gate> place_gates(const std::vector<Station>& course, double amount, Random* random) {
  std::vector<scene::Gate> gates;
  for (const Station& station : course) {
    const double direction = random->uniform(-std::numbers::pi, std::numbers::pi);
    const double away_m = amount * random->uniform(0.0, 0.7);
    Vector3d p_W = station.p_W + Vector3d(away_m * std::cos(direction), away_m * std::sin(direction),
                                          amount * random->uniform(-0.35, 0.35));
    scene::Gate gate = make_gate(p_W, station.yaw + amount * random->uniform(-40.0, 40.0) * kDegree, random);
    gate.X_WG.translation().z() = std::max(p_W.z(), gate.shape.outer_half_m + 0.02);
    gates.push_back(gate);
  }
  return gates;
}

Path path_through(const std::vector<scene::Gate>& gates, const std::vector<Station>& course, double beside_m,
                  double obey, Random* random) {
  std::vector<Vector3d> points;
  std::vector<Vector3d> directions;
  for (std::size_t k = 0; k < gates.size(); ++k) {
    const double angle = random->uniform(-std::numbers::pi, std::numbers::pi);
    const double away_m = beside_m * std::sqrt(random->uniform());
    points.push_back(gates[k].X_WG * Vector3d(0, away_m * std::cos(angle), away_m * std::sin(angle)));
    const Vector3d course_W(std::cos(course[k].yaw), std::sin(course[k].yaw), 0);
    directions.push_back((obey * gates[k].X_WG.linear().col(0) + (1.0 - obey) * course_W).normalized());
  }
  return round_path(points, directions);
}

Room draw_room(std::uint64_t seed, std::uint64_t number) {
  Random random(seed, kRoomStream + number);
  Room room;
  room.texture_seed = (std::uint64_t{random.bits()} << 32) | random.bits();
  room.floor_reflectance = static_cast<float>(random.uniform(0.2, 0.9));
  room.sensor.ambient = random.uniform(0.25, 1.2);
  room.sensor.lamp = random.uniform(0.0, 0.4);

  // Until it can be flown with all gates where they belong.
  for (bool good = false; !good;) {
    room.course = draw_course(&random);
    const std::vector<scene::Gate> gates = place_gates(room.course, 0.0, &random);
    good = flyable(path_through(gates, room.course, 0.0, 1.0, &random), gates, {}, 0.35);
  }

  Vector3d low = Vector3d::Constant(1e9);
  Vector3d high = Vector3d::Constant(-1e9);
  for (const Station& station : room.course) {
    low = low.cwiseMin(station.p_W);
    high = high.cwiseMax(station.p_W);
  }
  const double height_m = random.uniform(3.2, 7.0);
  const auto margin_m = [&] { return random.uniform(1.8, 5.0); };
  const double x0 = low.x() - margin_m();
  const double x1 = high.x() + margin_m();
  const double y0 = low.y() - margin_m();
  const double y1 = high.y() + margin_m();
  const auto any_reflectance = [&] { return static_cast<float>(random.uniform(0.1, 0.95)); };
  const std::array<Vector3d, 4> middles = {
      Vector3d(x0 - 0.1, 0.5 * (y0 + y1), 0.5 * height_m), Vector3d(x1 + 0.1, 0.5 * (y0 + y1), 0.5 * height_m),
      Vector3d(0.5 * (x0 + x1), y0 - 0.1, 0.5 * height_m), Vector3d(0.5 * (x0 + x1), y1 + 0.1, 0.5 * height_m)};
  for (std::size_t side = 0; side < 4; ++side) {
    const bool across_x = side < 2;
    const double half_m = 0.5 * (across_x ? y1 - y0 : x1 - x0) + 0.2;
    const Vector3d inward(side == 0 ? 1 : side == 1 ? -1 : 0, side == 2 ? 1 : side == 3 ? -1 : 0, 0);
    room.walls.push_back(
        {.X_WO = pose(middles[side], 0, 0, 0),
         .half_m = across_x ? Vector3d(0.1, half_m, 0.5 * height_m) : Vector3d(half_m, 0.1, 0.5 * height_m),
         .reflectance = any_reflectance()});
    for (std::uint32_t i = random.below(4); i > 0; --i) {  // doors, boards, windows, pictures
      const double half_width_m = random.uniform(0.2, 1.4);
      const double half_height_m = random.uniform(0.2, 1.1);
      const double along_m = random.uniform(-0.85, 0.85) * half_m;
      Vector3d p_W = middles[side] + 0.11 * inward;
      p_W += across_x ? Vector3d(0, along_m, 0) : Vector3d(along_m, 0, 0);
      p_W.z() = random.chance(0.3) ? half_height_m : random.uniform(0.8, 2.4);
      room.walls.push_back({.X_WO = pose(p_W, 0, 0, 0),
                            .half_m = across_x ? Vector3d(0.02, half_width_m, half_height_m)
                                               : Vector3d(half_width_m, 0.02, half_height_m),
                            .reflectance = any_reflectance()});
    }
  }
  if (random.chance(0.4)) {
    room.walls.push_back({.X_WO = pose({0.5 * (x0 + x1), 0.5 * (y0 + y1), height_m + 0.1}, 0, 0, 0),
                          .half_m = {0.5 * (x1 - x0) + 0.2, 0.5 * (y1 - y0) + 0.2, 0.1},
                          .reflectance = any_reflectance()});
  }

  const auto place = [&](double z_m) { return Vector3d(random.uniform(x0, x1), random.uniform(y0, y1), z_m); };
  const auto turn = [&] { return random.uniform(-std::numbers::pi, std::numbers::pi); };
  for (std::uint32_t i = 2 + random.below(8); i > 0; --i) {  // boxes, tables, shelves
    const Vector3d half_m(random.uniform(0.08, 0.7), random.uniform(0.08, 0.7), random.uniform(0.08, 1.0));
    room.clutter.push_back({upright_box(place(half_m.z()), turn(), half_m, &random)});
  }
  for (std::uint32_t i = random.below(6); i > 0; --i) {  // poles, half of them up to the ceiling
    const double half_width_m = random.uniform(0.015, 0.12);
    const double half_length_m = random.chance(0.5) ? 0.5 * height_m : random.uniform(0.4, 1.2);
    room.clutter.push_back(
        {upright_box(place(half_length_m), turn(), {half_width_m, half_width_m, half_length_m}, &random)});
  }
  for (std::uint32_t i = random.below(4); i > 0; --i) {
    const Vector3d feet_W = place(0.0);
    room.clutter.push_back(person_boxes(feet_W, turn(), &random));
  }
  return room;
}

}  // namespace gatefield::training
