#include "server/training/dataset.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstring>
#include <numbers>
#include <string>
#include <thread>
#include <type_traits>
#include <utility>

#include "common/base/multiversion.h"
#include "common/scene/world.h"

namespace gatefield::training {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
using Eigen::AngleAxisd;
using Eigen::Isometry3d;
using Eigen::Vector3d;

// --- The world of one sample. W: the target gate's centre is the origin, its axis is +x before its own tilt.
// ---------------------

Isometry3d pose(const Vector3d& p, double yaw, double pitch, double roll) {
  Isometry3d X = Isometry3d::Identity();
  X.linear() =
      (AngleAxisd(yaw, Vector3d::UnitZ()) * AngleAxisd(pitch, Vector3d::UnitY()) * AngleAxisd(roll, Vector3d::UnitX()))
          .toRotationMatrix();
  X.translation() = p;
  return X;
}

/// Gates stand nearly upright; 15 % are tilted by up to 40 deg.
Isometry3d gate_pose(const Vector3d& p, double yaw, Random* random) {
  const double limit = (random->chance(0.15) ? 40.0 : 10.0) * kDegree;
  // Squared, so that small tilts are the usual ones.
  const auto tilt = [&] { return limit * random->uniform() * random->uniform(-1.0, 1.0); };
  const double pitch = tilt();
  return pose(p, yaw, pitch, tilt());
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

/// Distance from a point to a box's surface, 0 inside.
double distance_m(const scene::Box& box, const Vector3d& p_W) {
  const Vector3d p_O = box.X_WO.inverse() * p_W;
  return (p_O.cwiseAbs() - box.half_m).cwiseMax(0.0).norm();
}

/// True when clutter would stand in a gate's opening or within 0.5 m before or behind it (sampled on a 3 x 3 x 3 grid).
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

/// Legs (or one pole) from the frame's lower edge down to the floor, some with feet. Tilted gates stand on upright legs
/// too.
void add_stand(const scene::Gate& gate, double floor_z_m, Random* random, std::vector<scene::Box>* boxes) {
  const double outer_m = gate.shape.outer_half_m;
  const bool two_legs = random->chance(0.6);
  const bool feet = random->chance(0.5);
  const double half_width_m = random->uniform(0.015, 0.05);
  const auto reflectance = random->chance(0.7) ? gate.reflectance : static_cast<float>(random->uniform(0.05, 0.95));
  const double yaw = std::atan2(gate.X_WG.linear()(1, 0), gate.X_WG.linear()(0, 0));
  const double leg_y_m = two_legs ? outer_m - random->uniform(0.03, 0.25) : 0.0;
  for (const double side : {1.0, -1.0}) {
    const Vector3d top_W = gate.X_WG * Vector3d(0, side * leg_y_m, -outer_m + 0.02);
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
  for (std::uint32_t i = random->below(3); i > 0; --i) {  // people: legs, body, head
    const Vector3d feet = place(floor_z_m);
    const double yaw = turn();
    const double height_m = random->uniform(1.5, 1.95);
    const auto reflectance = static_cast<float>(random->uniform(0.05, 0.8));
    const auto part = [&](double low, double high, double half_x_m, double half_y_m) {
      put({.X_WO = pose(feet + Vector3d(0, 0, 0.5 * (low + high) * height_m), yaw, 0, 0),
           .half_m = {half_x_m, half_y_m, 0.5 * (high - low) * height_m},
           .reflectance = reflectance});
    };
    part(0.0, 0.48, 0.09, 0.15);
    part(0.48, 0.84, 0.12, 0.23);
    part(0.86, 1.0, 0.10, 0.08);
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

/// Where the camera is, relative to the target gate: distances mostly 1 to 7 m, either side, up to 80 deg off the axis.
Vector3d camera_position(Random* random) {
  const double which = random->uniform();
  const double distance = which < 0.10   ? random->uniform(0.4, 1.0)
                          : which < 0.85 ? random->uniform(1.0, 7.0)
                                         : random->uniform(7.0, 10.0);
  const double limit = std::min(1.5, 0.8 * distance);
  const double height = random->uniform(-limit, limit);
  const double horizontal = std::sqrt(distance * distance - height * height);
  const double bearing = random->uniform(-80.0, 80.0) * kDegree;
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

struct Scenario {
  scene::World world;  ///< gates: first those that count (target first), then the ones of the wrong size
  std::size_t gates = 0;
  Isometry3d X_WC = Isometry3d::Identity();
};

Scenario draw_scenario(const CameraModel& camera, Random* random) {
  Scenario scenario;
  scene::World& world = scenario.world;

  // 17 % are meant to show no valid gate; with those that are hidden or cut off by chance they make about a fifth.
  const bool without = random->chance(0.17);
  const bool gate_free = without && random->chance(0.45);
  const double mount_pitch_up = 15.0 * kDegree;

  const double floor_z_m = -random->uniform(0.77, 3.0);
  world.has_floor = random->chance(0.93);
  world.floor_z_m = floor_z_m;
  world.floor_reflectance = static_cast<float>(random->uniform(0.2, 0.9));

  if (!gate_free) {
    world.gates.push_back(make_gate(Vector3d::Zero(), 0.0, random));
    const double which = random->uniform();
    const int others = which < 0.3 ? 0 : which < 0.6 ? 1 : which < 0.82 ? 2 : 3;
    add_other_gates(others, random, &world.gates);
  }
  scenario.gates = world.gates.size();
  for (scene::Gate& gate : world.gates) {
    // Raised when another gate's height or tilt would put its lower edge far into the floor.
    const double lowest_m = floor_z_m + gate.shape.outer_half_m;
    if (gate.X_WG.translation().z() < lowest_m) gate.X_WG.translation().z() = lowest_m;
    if (random->chance(0.5)) add_stand(gate, floor_z_m, random, &world.boxes);
  }
  if (random->chance(0.7)) add_room(floor_z_m, random, &world.boxes);
  add_clutter(floor_z_m, world.gates, random, &world.boxes);
  if (random->chance(gate_free ? 0.5 : 0.12)) {
    std::vector<scene::Gate> wrong;
    add_wrong_gates(world.gates, random, &wrong);
    world.gates.insert(world.gates.end(), wrong.begin(), wrong.end());
  }

  std::vector<scene::Box> solid = world.boxes;
  for (const scene::Gate& gate : world.gates) {
    const auto frame = scene::frame_boxes(gate);
    solid.insert(solid.end(), frame.begin(), frame.end());
  }
  for (int attempt = 0; attempt < 200; ++attempt) {
    const Vector3d p_WC = camera_position(random);
    if (p_WC.z() < floor_z_m + 0.15) continue;
    const bool free =
        std::all_of(solid.begin(), solid.end(), [&](const scene::Box& box) { return distance_m(box, p_WC) > 0.13; });
    if (!free) continue;
    Vector3d p_look = Vector3d::Zero();
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

std::uint8_t pack_surface(float cosine, float reflectance) {
  const auto high = static_cast<unsigned>(cosine * 15.0f + 0.5f);
  const auto low = static_cast<unsigned>(reflectance * 15.0f + 0.5f);
  return static_cast<std::uint8_t>(std::min(high, 15u) << 4 | std::min(low, 15u));
}

template <typename Container>
void sort_labels(Container* gates, int gate_count, int* valid_count) {
  std::sort(gates->begin(), gates->begin() + gate_count, [](const GateLabel& a, const GateLabel& b) {
    if (a.valid() != b.valid()) return a.valid();
    return a.p_CG.squaredNorm() < b.p_CG.squaredNorm();
  });
  *valid_count = static_cast<int>(
      std::count_if(gates->begin(), gates->begin() + gate_count, [](const GateLabel& gate) { return gate.valid(); }));
}

// --- The file. Little-endian, fixed-size records after one header; the number of records follows from the file's
// length. ---------

constexpr char kMagic[8] = {'G', 'F', 'D', 'A', 'T', 'A', 'S', 'T'};
constexpr std::uint32_t kVersion = 1;  ///< raise when the record or any distribution above changes

struct FileHeader {
  char magic[8];
  std::uint32_t version;
  std::uint32_t record_bytes;
  std::uint64_t seed;
  std::uint64_t first_index;
  std::uint32_t width_px;
  std::uint32_t height_px;
  double camera[6];  ///< fx, fy, cx, cy in pixels, smallest and largest depth in metres
  std::uint8_t reserved[40];
};
static_assert(sizeof(FileHeader) == 128 && std::is_trivially_copyable_v<FileHeader>);

struct GateRecord {
  float p_CG[3];
  float q_CG_xyzw[4];
  float visible_fraction;
  float inner_half_m;
  float outer_half_m;
  float thickness_m;
  std::uint32_t opening;
};
static_assert(sizeof(GateRecord) == 48);

struct Record {
  std::uint16_t clean_mm[kImageSize_px];
  std::uint8_t surface[kImageSize_px];
  GateRecord gates[kMaxGates];
  std::int32_t gate_count;
  std::int32_t valid_count;
  std::uint8_t reserved[24];
};
static_assert(sizeof(Record) % 32 == 0 && std::is_trivially_copyable_v<Record>);

FileHeader make_header(std::uint64_t seed, std::uint64_t first_index) {
  const CameraModel& camera = dataset_camera();
  FileHeader header{};
  std::copy_n(kMagic, 8, header.magic);
  header.version = kVersion;
  header.record_bytes = sizeof(Record);
  header.seed = seed;
  header.first_index = first_index;
  header.width_px = static_cast<std::uint32_t>(camera.width_px);
  header.height_px = static_cast<std::uint32_t>(camera.height_px);
  const double values[6] = {camera.fx_px, camera.fy_px,       camera.cx_px,
                            camera.cy_px, camera.min_depth_m, camera.max_depth_m};
  std::copy_n(values, 6, header.camera);
  return header;
}

void store(const Sample& sample, Record* record) {
  *record = Record{};
  std::copy_n(sample.clean_mm.begin(), kImageSize_px, record->clean_mm);
  std::copy_n(sample.surface.begin(), kImageSize_px, record->surface);
  record->gate_count = sample.gate_count;
  record->valid_count = sample.valid_count;
  for (std::size_t i = 0; i < static_cast<std::size_t>(sample.gate_count); ++i) {
    const GateLabel& gate = sample.gates[i];
    GateRecord& out = record->gates[i];
    std::copy_n(gate.p_CG.data(), 3, out.p_CG);
    std::copy_n(gate.q_CG.coeffs().data(), 4, out.q_CG_xyzw);
    out.visible_fraction = gate.visible_fraction;
    out.inner_half_m = static_cast<float>(gate.shape.inner_half_m);
    out.outer_half_m = static_cast<float>(gate.shape.outer_half_m);
    out.thickness_m = static_cast<float>(gate.shape.thickness_m);
    out.opening = gate.shape.opening == GateShape::Opening::kRound ? 1 : 0;
  }
}

Error file_error(const std::filesystem::path& file, const std::string& what) {
  return Error{"data set " + file.string() + ": " + what};
}
Error system_error(const std::filesystem::path& file, const char* what) {
  return file_error(file, std::string(what) + ": " + std::strerror(errno));
}

Status check_header(const std::filesystem::path& file, const FileHeader& header) {
  if (!std::equal(kMagic, kMagic + 8, header.magic)) return file_error(file, "is not a Gatefield data set");
  if (header.version != kVersion) {
    return file_error(file, "has format version " + std::to_string(header.version) + ", expected " +
                                std::to_string(kVersion) + "; delete it to have it made again");
  }
  const FileHeader expected = make_header(header.seed, header.first_index);
  if (std::memcmp(&header, &expected, sizeof(FileHeader)) != 0) {
    return file_error(file, "was made for another camera or record size (" + std::to_string(header.width_px) + " x " +
                                std::to_string(header.height_px) + " px, " + std::to_string(header.record_bytes) +
                                " bytes a record), expected " + std::to_string(expected.width_px) + " x " +
                                std::to_string(expected.height_px) + " px, " + std::to_string(expected.record_bytes) +
                                " bytes");
  }
  return {};
}

/// Closes what open() gave.
class Descriptor {
 public:
  explicit Descriptor(int number) : number_(number) {}
  ~Descriptor() {
    if (number_ >= 0) ::close(number_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int number() const { return number_; }

 private:
  int number_;
};

bool write_all(int descriptor, const void* data, std::size_t size) {
  const char* next = static_cast<const char*>(data);
  while (size > 0) {
    const ssize_t written = ::write(descriptor, next, size);
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return false;
    next += written;
    size -= static_cast<std::size_t>(written);
  }
  return true;
}

}  // namespace

const CameraModel& dataset_camera() {
  static const CameraModel camera = default_camera();
  return camera;
}

float visible_fraction(const CameraModel& camera, std::span<const std::uint16_t> clean_mm, const GateShape& shape,
                       const Eigen::Isometry3f& X_CG) {
  constexpr int kPoints = 64;
  constexpr float kTolerance_m = 0.15f;
  const auto middle_m = static_cast<float>(0.5 * (shape.inner_half_m + shape.outer_half_m));
  int seen = 0;
  for (int k = 0; k < kPoints; ++k) {
    Eigen::Vector3f p_G;
    if (shape.opening == GateShape::Opening::kRound) {
      const float angle_rad = 2.0f * std::numbers::pi_v<float> * static_cast<float>(k) / kPoints;
      p_G = {0.0f, middle_m * std::cos(angle_rad), middle_m * std::sin(angle_rad)};
    } else {
      constexpr int kPerSide = kPoints / 4;
      const int side = k / kPerSide;
      const float along_m = middle_m * (2.0f * (static_cast<float>(k % kPerSide) + 0.5f) / kPerSide - 1.0f);
      const float across_m = side < 2 ? middle_m : -middle_m;
      p_G = side % 2 == 0 ? Eigen::Vector3f(0.0f, across_m, along_m) : Eigen::Vector3f(0.0f, along_m, across_m);
    }
    const Eigen::Vector3f p_C = X_CG * p_G;
    if (!camera.sees(p_C.cast<double>())) continue;
    const auto u = static_cast<int>(camera.fx_px * p_C.x() / p_C.z() + camera.cx_px);
    const auto v = static_cast<int>(camera.fy_px * p_C.y() / p_C.z() + camera.cy_px);
    const float shown_m = 0.001f * static_cast<float>(clean_mm[static_cast<std::size_t>(v * camera.width_px + u)]);
    if (shown_m > 0.0f && std::abs(shown_m - p_C.z()) <= kTolerance_m) ++seen;
  }
  return static_cast<float>(seen) / kPoints;
}

Sample generate(std::uint64_t seed, std::uint64_t index) {
  const CameraModel& camera = dataset_camera();
  Random random(seed, index);
  const Scenario scenario = draw_scenario(camera, &random);

  static thread_local scene::DepthImage image;
  static thread_local scene::SurfaceImage surface;
  scene::DepthCamera(scenario.world).render(camera, scenario.X_WC, &image, &surface);

  Sample sample;
  sample.clean_mm.resize(kImageSize_px);
  sample.surface.resize(kImageSize_px);
  for (std::size_t i = 0; i < kImageSize_px; ++i) {
    sample.clean_mm[i] = static_cast<std::uint16_t>(image.depth_m[i] * 1000.0f + 0.5f);
    sample.surface[i] = pack_surface(surface.cos_incidence[i], surface.reflectance[i]);
  }
  const Isometry3d X_CW = scenario.X_WC.inverse();
  sample.gate_count = static_cast<int>(std::min<std::size_t>(scenario.gates, kMaxGates));
  for (std::size_t i = 0; i < static_cast<std::size_t>(sample.gate_count); ++i) {
    const Isometry3d X_CG = X_CW * scenario.world.gates[i].X_WG;
    GateLabel& label = sample.gates[i];
    label.p_CG = X_CG.translation().cast<float>();
    label.q_CG = Eigen::Quaterniond(X_CG.linear()).normalized().cast<float>();
    label.shape = scenario.world.gates[i].shape;
    label.visible_fraction = visible_fraction(camera, sample.clean_mm, label.shape, label.X_CG());
  }
  sort_labels(&sample.gates, sample.gate_count, &sample.valid_count);
  return sample;
}

void frame_mask(const SampleView& sample, const GateLabel& gate, std::span<std::uint8_t> mask) {
  constexpr float kGrow_m = 0.03f;
  const CameraModel& camera = dataset_camera();
  const Eigen::Matrix3f R_GC = gate.q_CG.conjugate().toRotationMatrix();
  const Eigen::Vector3f p_GC = -(R_GC * gate.p_CG);
  const float half_x_m = static_cast<float>(0.5 * gate.shape.thickness_m) + kGrow_m;
  const float inner_m = static_cast<float>(gate.shape.inner_half_m) - kGrow_m;
  const float outer_m = static_cast<float>(gate.shape.outer_half_m) + kGrow_m;
  const bool round = gate.shape.opening == GateShape::Opening::kRound;
  for (int v = 0; v < kImageHeight_px; ++v) {
    const auto ray_y = static_cast<float>((v + 0.5 - camera.cy_px) / camera.fy_px);
    for (int u = 0; u < kImageWidth_px; ++u) {
      const auto i = static_cast<std::size_t>(v * kImageWidth_px + u);
      const auto ray_x = static_cast<float>((u + 0.5 - camera.cx_px) / camera.fx_px);
      const float z_m = 0.001f * static_cast<float>(sample.clean_mm[i]);
      const Eigen::Vector3f p_G = z_m * (ray_x * R_GC.col(0) + ray_y * R_GC.col(1) + R_GC.col(2)) + p_GC;
      const float transverse_m = round ? std::hypot(p_G.y(), p_G.z()) : std::max(std::abs(p_G.y()), std::abs(p_G.z()));
      const bool on_frame =
          z_m > 0.0f && std::abs(p_G.x()) <= half_x_m && transverse_m >= inner_m && transverse_m <= outer_m;
      mask[i] = on_frame ? 1 : 0;
    }
  }
}

namespace {

GATEFIELD_MULTIVERSION void to_metres(const std::uint16_t* depth_mm, float* depth_m) {
  for (std::size_t i = 0; i < kImageSize_px; ++i) depth_m[i] = 0.001f * static_cast<float>(depth_mm[i]);
}

GATEFIELD_MULTIVERSION void unpack_surface(const std::uint8_t* surface, float* cosine, float* reflectance) {
  for (std::size_t i = 0; i < kImageSize_px; ++i) {
    cosine[i] = static_cast<float>(surface[i] >> 4) * (1.0f / 15.0f);
    reflectance[i] = static_cast<float>(surface[i] & 15) * (1.0f / 15.0f);
  }
}

}  // namespace

void draw_clean(const SampleView& sample, std::span<float> clean_m) {
  to_metres(sample.clean_mm.data(), clean_m.data());
}

void draw_noisy(const SampleView& sample, const scene::SensorNoise& noise, Random* random, std::span<float> noisy_m) {
  static thread_local scene::DepthImage clean;
  static thread_local scene::SurfaceImage surface;
  static thread_local scene::DepthImage noisy;
  clean.width_px = kImageWidth_px;
  clean.height_px = kImageHeight_px;
  clean.depth_m.resize(kImageSize_px);
  surface.cos_incidence.resize(kImageSize_px);
  surface.reflectance.resize(kImageSize_px);
  draw_clean(sample, clean.depth_m);
  unpack_surface(sample.surface.data(), surface.cos_incidence.data(), surface.reflectance.data());
  scene::apply_noise(noise, dataset_camera(), clean, surface, random, &noisy);
  std::copy_n(noisy.depth_m.begin(), kImageSize_px, noisy_m.begin());
}

Status generate_dataset(const std::filesystem::path& file, const DatasetOptions& options,
                        const std::function<bool(const Progress&)>& progress) {
  std::error_code folder_error;
  if (file.has_parent_path()) std::filesystem::create_directories(file.parent_path(), folder_error);
  if (folder_error) return file_error(file, "the folder can't be made: " + folder_error.message());
  const Descriptor descriptor(::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644));
  if (descriptor.number() < 0) return system_error(file, "can't be opened for writing");

  struct stat status {};
  if (::fstat(descriptor.number(), &status) != 0) return system_error(file, "can't be examined");
  const auto size = static_cast<std::uint64_t>(status.st_size);
  const FileHeader header = make_header(options.seed, options.first_index);
  std::uint64_t done = 0;
  if (size == 0) {
    if (!write_all(descriptor.number(), &header, sizeof(header))) return system_error(file, "can't be written");
  } else {
    FileHeader present{};
    if (size < sizeof(present) || ::pread(descriptor.number(), &present, sizeof(present), 0) != sizeof(present))
      return file_error(file, "is shorter than a header; delete it to have it made again");
    if (Status checked = check_header(file, present); !checked.ok()) return checked;
    if (present.seed != options.seed || present.first_index != options.first_index) {
      return file_error(file, "holds seed " + std::to_string(present.seed) + " from index " +
                                  std::to_string(present.first_index) + ", expected seed " +
                                  std::to_string(options.seed) + " from index " + std::to_string(options.first_index));
    }
    done = (size - sizeof(FileHeader)) / sizeof(Record);
  }
  if (done < options.count) {
    // What was cut short by a crash or a full disk goes away.
    const auto whole = static_cast<off_t>(sizeof(FileHeader) + done * sizeof(Record));
    if (::ftruncate(descriptor.number(), whole) != 0 || ::lseek(descriptor.number(), whole, SEEK_SET) != whole)
      return system_error(file, "can't be continued");
  }

  // Chunks are made side by side in memory and written in order, so that the file's length always says what is whole.
  constexpr std::uint64_t kChunk = 256;
  std::vector<Record> records(kChunk);
  const auto start = std::chrono::steady_clock::now();
  const std::uint64_t done_before = done;
  while (done < options.count) {
    const std::uint64_t count = std::min(kChunk, options.count - done);
    std::atomic<std::uint64_t> next{0};
    const auto work = [&] {
      for (std::uint64_t i = next++; i < count; i = next++)
        store(generate(options.seed, options.first_index + done + i), &records[i]);
    };
    {
      std::vector<std::jthread> helpers;
      for (int i = 1; i < options.threads; ++i) helpers.emplace_back(work);
      work();
    }
    if (!write_all(descriptor.number(), records.data(), count * sizeof(Record)))
      return system_error(file, "can't be written");
    done += count;

    if (progress) {
      const double elapsed_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
      const double rate_hz = static_cast<double>(done - done_before) / std::max(elapsed_s, 1e-9);
      if (!progress({done, options.count, rate_hz, static_cast<double>(options.count - done) / rate_hz})) break;
    }
  }
  return {};
}

struct Dataset::Mapping {
  const std::byte* data = nullptr;
  std::size_t bytes = 0;
  std::uint64_t count = 0;

  Mapping() = default;
  Mapping(const Mapping&) = delete;
  Mapping& operator=(const Mapping&) = delete;
  ~Mapping() {
    if (data != nullptr) ::munmap(const_cast<std::byte*>(data), bytes);
  }
  const FileHeader& header() const { return *reinterpret_cast<const FileHeader*>(data); }
  const Record* records() const { return reinterpret_cast<const Record*>(data + sizeof(FileHeader)); }
};

Dataset::Dataset(std::unique_ptr<Mapping> mapping) noexcept : mapping_(std::move(mapping)) {}
Dataset::~Dataset() = default;
Dataset::Dataset(Dataset&&) noexcept = default;
Dataset& Dataset::operator=(Dataset&&) noexcept = default;

Result<Dataset> Dataset::open(const std::filesystem::path& file) {
  const Descriptor descriptor(::open(file.c_str(), O_RDONLY | O_CLOEXEC));
  if (descriptor.number() < 0) return system_error(file, "can't be opened");
  struct stat status {};
  if (::fstat(descriptor.number(), &status) != 0) return system_error(file, "can't be examined");
  const auto bytes = static_cast<std::size_t>(status.st_size);
  if (bytes < sizeof(FileHeader)) return file_error(file, "is shorter than a header");
  void* const data = ::mmap(nullptr, bytes, PROT_READ, MAP_SHARED, descriptor.number(), 0);
  if (data == MAP_FAILED) return system_error(file, "can't be mapped");
  auto mapping = std::make_unique<Mapping>();
  mapping->data = static_cast<const std::byte*>(data);
  mapping->bytes = bytes;
  if (Status checked = check_header(file, mapping->header()); !checked.ok()) return Error{checked.error()};
  mapping->count = (bytes - sizeof(FileHeader)) / sizeof(Record);
  return Dataset(std::move(mapping));
}

std::uint64_t Dataset::size() const noexcept { return mapping_->count; }
std::uint64_t Dataset::seed() const noexcept { return mapping_->header().seed; }
std::uint64_t Dataset::first_index() const noexcept { return mapping_->header().first_index; }

SampleView Dataset::at(std::uint64_t index) const noexcept {
  const Record& record = mapping_->records()[index];
  SampleView view;
  view.clean_mm = record.clean_mm;
  view.surface = record.surface;
  view.gate_count = std::clamp(record.gate_count, 0, kMaxGates);
  view.valid_count = std::clamp(record.valid_count, 0, view.gate_count);
  for (std::size_t i = 0; i < static_cast<std::size_t>(view.gate_count); ++i) {
    const GateRecord& in = record.gates[i];
    GateLabel& gate = view.gates[i];
    gate.p_CG = Eigen::Map<const Eigen::Vector3f>(in.p_CG);
    gate.q_CG.coeffs() = Eigen::Map<const Eigen::Vector4f>(in.q_CG_xyzw);
    gate.visible_fraction = in.visible_fraction;
    gate.shape.inner_half_m = static_cast<double>(in.inner_half_m);
    gate.shape.outer_half_m = static_cast<double>(in.outer_half_m);
    gate.shape.thickness_m = static_cast<double>(in.thickness_m);
    gate.shape.opening = in.opening == 1 ? GateShape::Opening::kRound : GateShape::Opening::kSquare;
  }
  return view;
}

}  // namespace gatefield::training
