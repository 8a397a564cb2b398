#include "server/training/data/flights.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <opencv2/core.hpp>
#include <optional>
#include <string>

#include "server/training/data/fill.h"
#include "server/training/data/scene_parts.h"

namespace gatefield::training {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kGravity_m_s2 = 9.81;
constexpr double kMaxTurn_m_s2 = 16.0;    ///< across the path
constexpr double kMaxSpeedUp_m_s2 = 6.0;  ///< along the path
constexpr double kMaxCurvature_per_m = 1.7;
constexpr double kDrag_per_s = 0.3;  ///< deceleration per speed that the thrust has to make up for
constexpr double kLag_s = 0.07;      ///< sigma of the low-pass over attitudes
constexpr double kStep_m = 0.05;     ///< between points of a path
using Eigen::AngleAxisd;
using Eigen::Isometry3d;
using Eigen::Vector3d;

/// Streams of random numbers of one set: Random(seed, stream + number).
constexpr std::uint64_t kRoomStream = std::uint64_t{1} << 48;
constexpr std::uint64_t kPlacementStream = std::uint64_t{2} << 48;
constexpr std::uint64_t kFrameStream = std::uint64_t{3} << 48;

/// Where a gate of the course nominally stands. W: floor at z = 0, the course around the origin.
struct Station {
  Vector3d p_W = Vector3d::Zero();
  double yaw = 0.0;  ///< of the passing direction
};

struct Room {
  std::vector<Station> course;
  std::vector<scene::Box> walls;
  std::vector<std::vector<scene::Box>> clutter;  ///< things; a thing goes as a whole when it is in the way
  float floor_reflectance = 0.6f;
  scene::StereoOptions sensor;
  std::uint64_t texture_seed = 0;
};

/// A closed path in steps of about kStep_m.
struct Path {
  std::vector<Vector3d> p_W;
  std::vector<Vector3d> along;      ///< unit tangent
  std::vector<Vector3d> curvature;  ///< second derivative by arc length
  double step_m = kStep_m;

  std::size_t size() const noexcept { return p_W.size(); }
};

/// Closed Hermite curve through the points, then rounded by a Gaussian of 0.5 m along the path, so that acceleration
/// has no jumps.
Path round_path(const std::vector<Vector3d>& points, const std::vector<Vector3d>& directions) {
  const std::size_t n = points.size();
  std::vector<Vector3d> raw;
  for (std::size_t k = 0; k < n; ++k) {
    const Vector3d& a = points[k];
    const Vector3d& b = points[(k + 1) % n];
    const double distance_m = (b - a).norm();
    const Vector3d ta = distance_m * directions[k];
    const Vector3d tb = distance_m * directions[(k + 1) % n];
    const int steps = std::max(8, static_cast<int>(distance_m / (0.2 * kStep_m)));
    for (int i = 0; i < steps; ++i) {
      const double t = static_cast<double>(i) / steps;
      const double s = 1.0 - t;
      raw.push_back(s * s * (1.0 + 2.0 * t) * a + t * t * (3.0 - 2.0 * t) * b + s * s * t * ta - t * t * s * tb);
    }
  }
  const auto resample = [](const std::vector<Vector3d>& from, double* step_m) {
    std::vector<double> at_m(from.size() + 1, 0.0);
    for (std::size_t i = 0; i < from.size(); ++i) {
      at_m[i + 1] = at_m[i] + (from[(i + 1) % from.size()] - from[i]).norm();
    }
    const auto count = static_cast<std::size_t>(std::max(16.0, std::round(at_m.back() / kStep_m)));
    *step_m = at_m.back() / static_cast<double>(count);
    std::vector<Vector3d> even(count);
    std::size_t i = 0;
    for (std::size_t k = 0; k < count; ++k) {
      const double want_m = static_cast<double>(k) * *step_m;
      while (i + 1 < from.size() && at_m[i + 1] <= want_m) ++i;
      const double part = (want_m - at_m[i]) / std::max(at_m[i + 1] - at_m[i], 1e-9);
      even[k] = from[i] + part * (from[(i + 1) % from.size()] - from[i]);
    }
    return even;
  };
  Path path;
  const std::vector<Vector3d> even = resample(raw, &path.step_m);
  const double sigma = 0.5 / path.step_m;
  const int reach = static_cast<int>(3.0 * sigma);
  const auto count = static_cast<int>(even.size());
  std::vector<Vector3d> rounded(even.size(), Vector3d::Zero());
  double sum = 0.0;
  for (int j = -reach; j <= reach; ++j) sum += std::exp(-0.5 * j * j / (sigma * sigma));
  for (int i = 0; i < count; ++i) {
    for (int j = -reach; j <= reach; ++j) {
      rounded[static_cast<std::size_t>(i)] += std::exp(-0.5 * j * j / (sigma * sigma)) / sum *
                                              even[static_cast<std::size_t>(((i + j) % count + count) % count)];
    }
  }
  path.p_W = resample(rounded, &path.step_m);
  const std::size_t size = path.p_W.size();
  path.along.resize(size);
  path.curvature.resize(size);
  // Differences over four steps: the resampled points have corners of their own.
  constexpr std::size_t kWide = 4;
  const double wide_m = kWide * path.step_m;
  for (std::size_t i = 0; i < size; ++i) {
    const Vector3d& before = path.p_W[(i + size - kWide) % size];
    const Vector3d& after = path.p_W[(i + kWide) % size];
    path.along[i] = (after - before).normalized();
    path.curvature[i] = (after - 2.0 * path.p_W[i] + before) / (wide_m * wide_m);
  }
  return path;
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

/// Smallest distance between the path and the boxes, looked at every 0.1 m.
bool clear(const Path& path, const std::vector<scene::Box>& boxes, double margin_m) {
  for (const scene::Box& box : boxes) {
    const double reach_m = box.half_m.norm() + margin_m;
    for (std::size_t i = 0; i < path.size(); i += 2) {
      if ((path.p_W[i] - box.X_WO.translation()).squaredNorm() > reach_m * reach_m) continue;
      if (distance_m(box, path.p_W[i]) < margin_m) return false;
    }
  }
  return true;
}

bool flyable(const Path& path, const std::vector<scene::Gate>& gates, const std::vector<scene::Box>& others,
             double margin_m) {
  for (std::size_t i = 0; i < path.size(); ++i) {
    if (path.curvature[i].norm() > kMaxCurvature_per_m || path.p_W[i].z() < 0.35) return false;
  }
  for (const scene::Gate& gate : gates) {
    if (!clear(path, scene::frame_boxes(gate), margin_m)) return false;
  }
  return clear(path, others, margin_m);
}

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

/// Gates on the course: displaced, turned and tilted by `amount` times the most.
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

/// Speed along the path: `wanted_m_s`, less in curves, with room to slow down before and to speed up after them.
std::vector<double> plan_speed(const Path& path, double wanted_m_s) {
  const std::size_t n = path.size();
  std::vector<double> speed_m_s(n);
  for (std::size_t i = 0; i < n; ++i) {
    speed_m_s[i] = std::min(wanted_m_s, std::sqrt(kMaxTurn_m_s2 / std::max(path.curvature[i].norm(), 1e-3)));
  }
  const double gain = 2.0 * kMaxSpeedUp_m_s2 * path.step_m;
  for (std::size_t round = 0; round < 2 * n; ++round) {  // twice around: the path is closed
    const std::size_t i = round % n;
    double& after = speed_m_s[(i + 1) % n];
    after = std::min(after, std::sqrt(speed_m_s[i] * speed_m_s[i] + gain));
  }
  for (std::size_t round = 2 * n; round > 0; --round) {
    const std::size_t i = (round - 1) % n;
    const double after = speed_m_s[(i + 1) % n];
    speed_m_s[i] = std::min(speed_m_s[i], std::sqrt(after * after + gain));
  }
  return speed_m_s;
}

/// Value between two entries of a closed list.
template <typename T>
T between(const std::vector<T>& list, double at) {
  const double whole = std::floor(at);
  const std::size_t i = static_cast<std::size_t>(whole) % list.size();
  const double part = at - whole;
  return (1.0 - part) * list[i] + part * list[(i + 1) % list.size()];
}

std::string note_of(const FlightOptions& options) {
  return "generated by gatefield-train, second sensor " + std::to_string(kStereoVersion) + ": flights of " +
         std::to_string(options.frames) + " frames at " + std::to_string(std::lround(options.rate_hz)) +
         " Hz through " + std::to_string(options.rooms) + " rooms";
}

}  // namespace

Status validate(const FlightOptions& options) {
  const auto wrong = [](const char* field, double value, const char* expected) {
    return Error{std::string("flights.") + field + " is " + std::to_string(value) + ", expected " + expected};
  };
  if (options.rooms < 1) return wrong("rooms", 0.0, "at least 1");
  if (options.frames < 1) return wrong("frames", 0.0, "at least 1");
  if (options.threads < 1) return wrong("threads", options.threads, "at least 1");
  if (!(options.rate_hz >= 1.0 && options.rate_hz <= 240.0)) return wrong("rate_hz", options.rate_hz, "1 to 240 Hz");
  return {};
}

Flight draw_flight(const FlightOptions& options, std::uint64_t index) {
  const Room room = draw_room(options.seed, index % options.rooms);
  Random random(options.seed, kPlacementStream + index);

  Flight flight;
  flight.sensor = room.sensor;
  flight.texture_seed = room.texture_seed;
  flight.world.has_floor = true;
  flight.world.floor_z_m = 0.0;
  flight.world.floor_reflectance = room.floor_reflectance;

  // A placement that can't be flown is drawn again, after many attempts with smaller displacements.
  Path path;
  std::vector<scene::Box> stands;
  for (int attempt = 0;; ++attempt) {
    const double amount = std::max(0.0, 1.0 - std::max(0, attempt - 40) / 100.0);
    flight.world.gates = place_gates(room.course, amount, &random);
    stands.clear();
    for (const scene::Gate& gate : flight.world.gates) {
      if (random.chance(0.6)) add_stand(gate, 0.0, &random, &stands);
    }
    std::vector<scene::Box> others = room.walls;
    others.insert(others.end(), stands.begin(), stands.end());
    path = path_through(flight.world.gates, room.course, 0.3 * amount, random.uniform(0.5, 1.0), &random);
    if (flyable(path, flight.world.gates, others, 0.15)) break;
    if (attempt >= 400) break;  // stands may block what the bare course leaves free; then the flight is a close one
  }

  flight.world.boxes = room.walls;
  for (const std::vector<scene::Box>& thing : room.clutter) {
    const bool in_the_way = !clear(path, thing, 0.5) || std::any_of(thing.begin(), thing.end(), [&](const auto& box) {
      return std::any_of(flight.world.gates.begin(), flight.world.gates.end(),
                         [&](const scene::Gate& gate) { return blocks(box, gate); });
    });
    if (!in_the_way) flight.world.boxes.insert(flight.world.boxes.end(), thing.begin(), thing.end());
  }
  flight.world.boxes.insert(flight.world.boxes.end(), stands.begin(), stands.end());

  const std::vector<double> speed_m_s = plan_speed(path, random.uniform(3.0, 9.0));
  const double look_ahead_m = random.uniform(0.3, 2.5);
  const double beside_rad = 25.0 * kDegree * random.uniform(-1.0, 1.0) * random.uniform();
  const Isometry3d X_BC = dataset_camera().X_BC;
  double at = random.uniform(0.0, static_cast<double>(path.size()));
  // Thrust and gaze are low-passed over time, as a vehicle's inertia does it; the margin is what that takes.
  const int margin = static_cast<int>(std::lround(3.0 * kLag_s * options.rate_hz));
  const auto frames = static_cast<int>(options.frames);
  std::vector<Vector3d> p_WB;
  std::vector<Vector3d> thrust_W;
  std::vector<Vector3d> toward_W;
  for (int frame = -margin; frame < frames + margin; ++frame) {
    const double v_m_s = between(speed_m_s, at);
    const double ahead_m_s = between(speed_m_s, at + 2.0);
    const double behind_m_s = between(speed_m_s, at + static_cast<double>(path.size()) - 2.0);
    const Vector3d along_W = between(path.along, at).normalized();
    // a = v^2 k + v v' t
    const double speed_up = v_m_s * (ahead_m_s - behind_m_s) / (4.0 * path.step_m);
    Vector3d thrust = v_m_s * v_m_s * between(path.curvature, at) + (speed_up + kDrag_per_s * v_m_s) * along_W +
                      Vector3d(0, 0, kGravity_m_s2);
    thrust.z() = std::max(thrust.z(), 0.4 * kGravity_m_s2);
    p_WB.push_back(between(path.p_W, at));
    thrust_W.push_back(thrust);
    toward_W.push_back(AngleAxisd(beside_rad, Vector3d::UnitZ()) *
                       (between(path.p_W, at + (0.2 + look_ahead_m) / path.step_m) - p_WB.back()));
    at = std::fmod(at + v_m_s / (options.rate_hz * path.step_m), static_cast<double>(path.size()));
  }
  const auto smooth = [&](const std::vector<Vector3d>& list, int middle) {
    Vector3d sum = Vector3d::Zero();
    for (int k = -margin; k <= margin; ++k) {
      const double t = k / (kLag_s * options.rate_hz);
      const int i = std::clamp(middle + k, 0, static_cast<int>(list.size()) - 1);
      sum += std::exp(-0.5 * t * t) * list[static_cast<std::size_t>(i)];
    }
    return sum;
  };
  for (int frame = margin; frame < margin + frames; ++frame) {
    const Vector3d up_W = smooth(thrust_W, frame).normalized();
    Eigen::Matrix3d R_WB;
    R_WB.col(2) = up_W;
    R_WB.col(1) = up_W.cross(smooth(toward_W, frame)).normalized();
    R_WB.col(0) = R_WB.col(1).cross(up_W);
    Isometry3d X_WB = Isometry3d::Identity();
    X_WB.linear() = R_WB;
    X_WB.translation() = p_WB[static_cast<std::size_t>(frame)];
    flight.X_WC.push_back(X_WB * X_BC);
  }
  return flight;
}

Sample measure(const FlightOptions& options, const Flight& flight, std::uint64_t index, std::uint32_t frame,
               const scene::StereoCamera& stereo, const scene::DepthCamera& truth) {
  const CameraModel& camera = dataset_camera();
  const Isometry3d& X_WC = flight.X_WC[frame];
  Random random(options.seed, kFrameStream + index * options.frames + frame);
  static thread_local scene::DepthImage clean;
  static thread_local scene::DepthImage measured;
  truth.render(camera, X_WC, &clean);
  stereo.render(camera, X_WC, &random, &measured);

  Sample sample;
  const auto to_mm = [](const scene::DepthImage& image) {
    std::vector<std::uint16_t> depth_mm(image.depth_m.size());
    for (std::size_t i = 0; i < depth_mm.size(); ++i) {
      depth_mm[i] = static_cast<std::uint16_t>(image.depth_m[i] * 1000.0f + 0.5f);
    }
    return depth_mm;
  };
  sample.clean_mm = to_mm(clean);
  sample.measured_mm = to_mm(measured);
  sample.X_WC = X_WC.cast<float>();
  sample.sequence = static_cast<std::uint32_t>(index);
  sample.time_s = frame / options.rate_hz;

  // A course may have more gates than a sample keeps: those in view first, then the nearest.
  const Isometry3d X_CW = X_WC.inverse();
  std::vector<GateLabel> labels;
  for (const scene::Gate& gate : flight.world.gates) {
    const Isometry3d X_CG = X_CW * gate.X_WG;
    GateLabel label;
    label.p_CG = X_CG.translation().cast<float>();
    label.q_CG = Eigen::Quaterniond(X_CG.linear()).normalized().cast<float>();
    label.shape = gate.shape;
    label.visible_fraction = visible_fraction(camera, sample.clean_mm, label.shape, label.X_CG());
    labels.push_back(label);
  }
  std::stable_sort(labels.begin(), labels.end(), [](const GateLabel& a, const GateLabel& b) {
    if (a.valid() != b.valid()) return a.valid();
    return a.p_CG.squaredNorm() < b.p_CG.squaredNorm();
  });
  sample.gate_count = static_cast<int>(std::min<std::size_t>(labels.size(), kMaxGates));
  std::copy_n(labels.begin(), sample.gate_count, sample.gates.begin());
  sort_gates(&sample);
  return sample;
}

Status generate_flights(const std::filesystem::path& file, const FlightOptions& options,
                        const std::function<bool(const Progress&)>& progress) {
  if (Status valid = validate(options); !valid) return valid;
  DatasetInfo info;
  info.kind = DatasetKind::kStereo;
  info.seed = options.seed;
  info.note = note_of(options);
  DatasetColumns columns;
  columns.X_WC = columns.sequence = columns.time = true;

  cv::setNumThreads(1);  // flights are made side by side; OpenCV's own threads would only get in their way
  const auto make = [&](std::uint64_t done, std::uint64_t job, std::vector<Sample>* samples) {
    const std::uint64_t index = done / options.frames + job;
    const std::uint64_t begin = index * options.frames;
    if (begin >= options.count) return;
    const Flight flight = draw_flight(options, index);
    const scene::StereoCamera stereo(flight.world, flight.sensor, flight.texture_seed);
    const scene::DepthCamera truth(flight.world);
    const std::uint64_t end = std::min(begin + options.frames, options.count);
    for (std::uint64_t at = std::max(begin, done); at < end; ++at)
      samples->push_back(measure(options, flight, index, static_cast<std::uint32_t>(at - begin), stereo, truth));
  };
  const auto jobs = static_cast<std::uint64_t>(options.threads);
  return fill_dataset(file, {info, columns, options.count, jobs, options.threads, make}, progress);
}

}  // namespace gatefield::training
