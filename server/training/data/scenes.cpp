#include "server/training/data/scenes.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <vector>

#include "server/training/data/scene_parts.h"

namespace gatefield::training {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
using Eigen::AngleAxisd;
using Eigen::Isometry3d;
using Eigen::Vector3d;

// The world of one sample. W: the target gate's centre is the origin, its axis is +x before its own tilt.

void add_other_gates(int count, Random* random, std::vector<scene::Gate>* gates) {
  // On a course: a circle that the target gate's axis touches, 4 to 7 gates on it. Or anywhere 3 to 12 m away.
  const double radius_m = random->uniform(4.0, 9.0);
  const double side = random->chance(0.5) ? 1.0 : -1.0;
  const double step_rad = 2.0 * std::numbers::pi / (4.0 + random->below(4));
  const bool on_course = random->chance(0.65);
  for (int i = 0; i < count; ++i) {
    for (int attempt = 0; attempt < 20; ++attempt) {
      Vector3d p_WG;
      double yaw = 0.0;
      if (i == 0 && random->chance(0.3)) {
        // A close pair: beside, above-beside or behind the target, about parallel to it.
        const double away_m = random->uniform(1.6, 3.2);
        const double direction = random->uniform(-std::numbers::pi, std::numbers::pi);
        p_WG = {away_m * std::cos(direction), away_m * std::sin(direction), random->uniform(-0.4, 0.4)};
        yaw = random->uniform(-40.0, 40.0) * kDegree;
      } else if (on_course) {
        const double along_rad = step_rad * (i % 2 == 0 ? i / 2 + 1 : -(i / 2 + 1));
        p_WG = {radius_m * std::sin(along_rad), side * radius_m * (1.0 - std::cos(along_rad)), 0.0};
        p_WG += Vector3d(random->uniform(-0.7, 0.7), random->uniform(-0.7, 0.7), random->uniform(-0.7, 0.7));
        yaw = side * along_rad + random->uniform(-40.0, 40.0) * kDegree;
      } else {
        const double away_m = random->uniform(3.0, 12.0);
        const double direction = random->uniform(-std::numbers::pi, std::numbers::pi);
        p_WG = {away_m * std::cos(direction), away_m * std::sin(direction), random->uniform(-1.0, 1.5)};
        yaw = random->uniform(-std::numbers::pi, std::numbers::pi);
      }
      const bool apart = std::all_of(gates->begin(), gates->end(), [&](const scene::Gate& gate) {
        return (gate.X_WG.translation() - p_WG).norm() > 1.55;
      });
      if (!apart) continue;
      gates->push_back(make_gate(p_WG, yaw, random));
      break;
    }
  }
}

void add_room(double floor_z_m, Random* random, std::vector<scene::Box>* boxes) {
  const double yaw = random->uniform(-std::numbers::pi, std::numbers::pi);
  const double height_m = random->uniform(2.5, 8.0);
  const auto reflectance = static_cast<float>(random->uniform(0.2, 0.95));
  for (int wall = 0; wall < 4; ++wall) {
    if (random->chance(0.15)) continue;  // an open side
    const double away_m = random->uniform(4.0, 20.0);
    const double direction = yaw + 0.5 * std::numbers::pi * wall;
    scene::Box box{
        .X_WO = pose({away_m * std::cos(direction), away_m * std::sin(direction), floor_z_m + 0.5 * height_m},
                     direction, 0, 0),
        .half_m = {0.1, 25.0, 0.5 * height_m},
        .reflectance = reflectance};
    boxes->push_back(box);
  }
  if (random->chance(0.35)) {
    boxes->push_back({.X_WO = pose({0, 0, floor_z_m + height_m + 0.1}, yaw, 0, 0),
                      .half_m = {25.0, 25.0, 0.1},
                      .reflectance = static_cast<float>(random->uniform(0.2, 0.95))});
  }
}

void add_clutter(double floor_z_m, const std::vector<scene::Gate>& gates, Random* random,
                 std::vector<scene::Box>* boxes) {
  const auto put = [&](const scene::Box& box) {
    for (const scene::Gate& gate : gates) {
      if (blocks(box, gate)) return;
    }
    boxes->push_back(box);
  };
  const auto place = [&](double z_m) {
    const double away_m = random->uniform(0.9, 10.0);
    const double direction = random->uniform(-std::numbers::pi, std::numbers::pi);
    return Vector3d(away_m * std::cos(direction), away_m * std::sin(direction), z_m);
  };
  const auto turn = [&] { return random->uniform(-std::numbers::pi, std::numbers::pi); };

  for (std::uint32_t i = random->below(6); i > 0; --i) {  // poles, some lying or hanging
    const double half_width_m = random->uniform(0.015, 0.12);
    const double half_length_m = random->uniform(0.4, 2.5);
    scene::Box pole =
        upright_box(place(floor_z_m + half_length_m), turn(), {half_width_m, half_width_m, half_length_m}, random);
    if (random->chance(0.2)) {
      pole.X_WO = pose(pole.X_WO.translation() + Vector3d(0, 0, random->uniform(-0.5, 1.5)), turn(),
                       random->uniform(0.0, 90.0) * kDegree, 0);
    }
    put(pole);
  }
  for (std::uint32_t i = random->below(5); i > 0; --i) {  // boxes
    const Vector3d half_m(random->uniform(0.08, 0.7), random->uniform(0.08, 0.7), random->uniform(0.08, 0.9));
    const double lifted_m = random->chance(0.25) ? random->uniform(0.0, 2.5) : 0.0;
    put(upright_box(place(floor_z_m + half_m.z() + lifted_m), turn(), half_m, random));
  }
  for (std::uint32_t i = random->below(3); i > 0; --i) {
    const Vector3d feet = place(floor_z_m);
    for (const scene::Box& part : person_boxes(feet, turn(), random)) put(part);
  }
}

/// Frames of the wrong size: they look like gates, but are none.
void add_wrong_gates(const std::vector<scene::Gate>& gates, Random* random, std::vector<scene::Gate>* wrong) {
  for (std::uint32_t i = random->below(2) + 1; i > 0; --i) {
    const double away_m = random->uniform(1.8, 7.0);
    const double direction = random->uniform(-std::numbers::pi, std::numbers::pi);
    const Vector3d p_W(away_m * std::cos(direction), away_m * std::sin(direction), random->uniform(-0.6, 0.8));
    scene::Gate gate = make_gate(p_W, random->uniform(-std::numbers::pi, std::numbers::pi), random);
    gate.shape.inner_half_m = random->chance(0.5) ? random->uniform(0.18, 0.33) : random->uniform(0.75, 1.2);
    gate.shape.outer_half_m = gate.shape.inner_half_m + random->uniform(0.08, 0.3);
    const auto apart = [&](const scene::Gate& other) {
      return (other.X_WG.translation() - p_W).norm() > gate.shape.outer_half_m + other.shape.outer_half_m;
    };
    if (std::all_of(gates.begin(), gates.end(), apart) && std::all_of(wrong->begin(), wrong->end(), apart)) {
      wrong->push_back(gate);
    }
  }
}

/// Where the camera is, relative to the target gate: distances mostly 1 to 7 m (somewhat more of the near ones), either
/// side, up to 80 deg off the axis; now and then beyond, where the posts stand in a line.
Vector3d camera_position(Random* random) {
  const double which = random->uniform();
  const double distance = which < 0.10   ? random->uniform(0.3, 1.0)
                          : which < 0.85 ? 1.0 + 6.0 * std::pow(random->uniform(), 1.2)
                                         : random->uniform(7.0, 10.0);
  const double limit = std::min(1.5, 0.8 * distance);
  const double height = random->uniform(-limit, limit);
  const double horizontal = std::sqrt(distance * distance - height * height);
  const bool in_line = random->chance(0.05);
  const double bearing =
      (in_line ? random->uniform(80.0, 90.0) * (random->chance(0.5) ? 1.0 : -1.0) : random->uniform(-80.0, 80.0)) *
      kDegree;
  const double side = random->chance(0.5) ? -1.0 : 1.0;
  return {side * horizontal * std::cos(bearing), horizontal * std::sin(bearing), height};
}

/// Attitude of the body as in racing: nose down up to 45 deg, up to 35, roll up to 60. Yaw about toward p_look.
Eigen::Matrix3d body_attitude(const Vector3d& p_WC, const Vector3d& p_look, double mount_pitch_up, Random* random) {
  const Vector3d to_gate = p_look - p_WC;
  const double limit_yaw = 40.0 * kDegree;
  const double yaw_error = random->chance(0.35) ? random->uniform(-limit_yaw, limit_yaw)
                                                : std::clamp(0.2 * random->normal(), -limit_yaw, limit_yaw);
  const double yaw = std::atan2(to_gate.y(), to_gate.x()) + yaw_error;
  const double elevation = std::atan2(to_gate.z(), std::hypot(to_gate.x(), to_gate.y()));
  // Pitch is positive nose down. Half of the time as a racing drone that keeps the gate in view has it, half of the
  // time any.
  double pitch = random->chance(0.5) ? mount_pitch_up - elevation + 0.22 * random->normal()
                                     : 0.5 * (random->uniform(-35.0, 45.0) + random->uniform(-35.0, 45.0)) * kDegree;
  pitch = std::clamp(pitch, -35.0 * kDegree, 45.0 * kDegree);
  const double limit_roll = 60.0 * kDegree;
  const double roll = random->chance(0.35) ? random->uniform(-limit_roll, limit_roll)
                                           : std::clamp(0.3 * random->normal(), -limit_roll, limit_roll);
  return pose(Vector3d::Zero(), yaw, pitch, roll).linear();
}

/// A gate about as far from the camera as the target: beside it, or above or below. Which of the two is meant can't be
/// told from the distance then.
void add_partner(const Vector3d& p_WC, Random* random, std::vector<scene::Gate>* gates) {
  const Vector3d to_target = -p_WC;
  const double distance = to_target.norm();
  for (int attempt = 0; attempt < 20; ++attempt) {
    // How far apart the two centres are; across, the image is wider than it is high.
    const double apart_m = random->uniform(1.6, 3.5);
    if (apart_m > 1.4 * distance) continue;
    const double turn = 2.0 * std::asin(0.5 * apart_m / distance) * (random->chance(0.5) ? 1.0 : -1.0);
    const bool stacked = random->chance(0.15);
    const Vector3d axis = stacked ? to_target.cross(Vector3d::UnitZ()).normalized() : Vector3d(Vector3d::UnitZ());
    const Vector3d direction = AngleAxisd(turn, axis) * to_target.normalized();
    const Vector3d p_WG = p_WC + (distance + random->uniform(-0.3, 0.3)) * direction;
    if (p_WG.norm() < 1.55) continue;
    const double yaw = random->chance(0.5)
                           ? random->uniform(-40.0, 40.0) * kDegree
                           : std::atan2(direction.y(), direction.x()) + random->uniform(-75.0, 75.0) * kDegree;
    gates->push_back(make_gate(p_WG, yaw, random));
    return;
  }
}

/// Before rendering: how much of the midline lies in the image, occlusion left aside.
double fraction_in_image(const CameraModel& camera, const scene::Gate& gate, const Isometry3d& X_WC) {
  const Isometry3d X_CG = X_WC.inverse() * gate.X_WG;
  const double middle_m = 0.5 * (gate.shape.inner_half_m + gate.shape.outer_half_m);
  int seen = 0;
  for (int side = 0; side < 4; ++side) {
    for (int k = 0; k < 4; ++k) {
      const double along_m = middle_m * (2.0 * (k + 0.5) / 4.0 - 1.0);
      const double across_m = side < 2 ? middle_m : -middle_m;
      const Vector3d p_G = side % 2 == 0 ? Vector3d(0, across_m, along_m) : Vector3d(0, along_m, across_m);
      if (camera.sees(X_CG * p_G)) ++seen;
    }
  }
  return seen / 16.0;
}

/// The numbers that openings are drawn with: named by what `random` would give next, without taking anything from it.
Random opening_stream(Random random) {
  constexpr std::uint64_t kStream = 0x726F756E64;
  const std::uint64_t high = random.bits();
  return Random(high << 32 | random.bits(), kStream);
}

void draw_openings(double round_part, Random* openings, std::vector<scene::Gate>* gates) {
  for (scene::Gate& gate : *gates) {
    if (openings->chance(round_part)) gate.shape.opening = GateShape::Opening::kRound;
  }
}

}  // namespace

Scenario draw_scenario(const CameraModel& camera, Random* random, const SceneOptions& options) {
  Random openings = opening_stream(*random);
  Scenario scenario;
  scene::World& world = scenario.world;

  // 20 % are meant to show no valid gate; with those that are hidden or cut off by chance they make 22 %.
  const bool without = random->chance(0.20);
  const bool gate_free = without && random->chance(0.45);
  const double mount_pitch_up = 15.0 * kDegree;

  const double floor_z_m = -random->uniform(0.77, 3.0);
  world.has_floor = random->chance(0.93);
  world.floor_z_m = floor_z_m;
  world.floor_reflectance = static_cast<float>(random->uniform(0.2, 0.9));

  std::optional<Vector3d> eye_W;  // where the camera will be, when gates were placed to suit
  if (!gate_free) {
    world.gates.push_back(make_gate(Vector3d::Zero(), 0.0, random));
    const double which = random->uniform();
    int others = which < 0.3 ? 0 : which < 0.6 ? 1 : which < 0.82 ? 2 : 3;
    if (!without && random->chance(0.12)) {
      for (int attempt = 0; attempt < 20 && !eye_W; ++attempt) {
        const Vector3d p_WC = camera_position(random);
        if (p_WC.norm() > 1.6 && p_WC.z() > floor_z_m + 0.15) eye_W = p_WC;
      }
      if (eye_W) {
        add_partner(*eye_W, random, &world.gates);
        others = std::max(0, others - 1);
      }
    }
    add_other_gates(others, random, &world.gates);
  }
  scenario.gates = world.gates.size();
  draw_openings(options.round_part, &openings, &world.gates);
  for (scene::Gate& gate : world.gates) {
    // Raised when another gate's height or tilt would put its lower edge far into the floor.
    const double lowest_m = floor_z_m + gate.shape.outer_half_m;
    if (gate.X_WG.translation().z() < lowest_m) gate.X_WG.translation().z() = lowest_m;
    if (random->chance(0.5)) add_stand(gate, floor_z_m, random, &world.boxes);
  }
  if (options.alone) {
    world.has_floor = false;
  } else {
    if (random->chance(0.7)) add_room(floor_z_m, random, &world.boxes);
    add_clutter(floor_z_m, world.gates, random, &world.boxes);
  }
  if (random->chance(gate_free ? 0.5 : 0.18)) {
    std::vector<scene::Gate> wrong;
    add_wrong_gates(world.gates, random, &wrong);
    draw_openings(options.round_part, &openings, &wrong);
    world.gates.insert(world.gates.end(), wrong.begin(), wrong.end());
  }

  std::vector<scene::Box> solid = world.boxes;
  for (const scene::Gate& gate : world.gates) {
    const auto frame = scene::frame_boxes(gate);
    solid.insert(solid.end(), frame.begin(), frame.end());
  }
  for (int attempt = 0; attempt < 200; ++attempt) {
    const bool keeps_eye = eye_W && attempt == 0;
    const Vector3d p_WC = keeps_eye ? *eye_W : camera_position(random);
    if (p_WC.z() < floor_z_m + 0.15) continue;
    const bool free =
        std::all_of(solid.begin(), solid.end(), [&](const scene::Box& box) { return distance_m(box, p_WC) > 0.13; });
    if (!free) continue;
    Vector3d p_look = Vector3d::Zero();
    if (keeps_eye && world.gates.size() > 1) {
      p_look = random->uniform(0.3, 0.6) * world.gates[1].X_WG.translation();  // somewhere between the two
    }
    if (without && !gate_free) {
      // Looks away from the target: somewhere 60 to 180 deg off.
      const double away = random->uniform(60.0, 180.0) * kDegree * (random->chance(0.5) ? 1.0 : -1.0);
      p_look = p_WC + AngleAxisd(away, Vector3d::UnitZ()) * (p_look - p_WC);
    }
    bool in_view = false;
    for (int turn = 0; turn < 8 && !in_view; ++turn) {
      scenario.X_WC.linear() = body_attitude(p_WC, p_look, mount_pitch_up, random) * camera.X_BC.linear();
      scenario.X_WC.translation() = p_WC;
      in_view = without || fraction_in_image(camera, world.gates.front(), scenario.X_WC) >= 0.3;
    }
    if (in_view) break;
  }
  return scenario;
}

}  // namespace gatefield::training
