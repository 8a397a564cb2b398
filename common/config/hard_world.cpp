#include "common/config/hard_world.h"

#include <algorithm>
#include <cctype>
#include <numbers>
#include <utility>

#include "common/base/text.h"
#include "common/config/scenario.pb.h"

namespace gatefield::config {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

static_assert(static_cast<int>(WorldPart::kFurniture) == FURNITURE && static_cast<int>(WorldPart::kHard) == HARD &&
              static_cast<int>(WorldPart::kThrustUnknown) == THRUST_UNKNOWN &&
              static_cast<int>(WorldPart::kMounting) == MOUNTING && WorldPartKind_MAX == FURNITURE);

struct Size {
  const char* field;
  WorldPart part;
  double low, high;
  const char* unit;
};
constexpr Size kSizes[] = {
    {"drift_m_s", WorldPart::kDrift, 0, 1, " m/s"},
    {"drift_yaw_deg_s", WorldPart::kDrift, 0, 10, " deg/s"},
    {"drift_tilt_deg", WorldPart::kDrift, 0, 10, " degrees"},
    {"drift_s", WorldPart::kDrift, 0.01, 1000, " s"},
    {"jumps_hz", WorldPart::kJumps, 0, 10, " Hz"},
    {"jump_m", WorldPart::kJumps, 0, 2, " m"},
    {"jump_yaw_deg", WorldPart::kJumps, 0, 45, " degrees"},
    {"lag_ms", WorldPart::kLag, 0, 200, " ms"},
    {"camera_rate_hz", WorldPart::kSlowCamera, 1, 240, " Hz"},
    {"frame_delay_ms", WorldPart::kSlowCamera, 0, 200, " ms"},
    {"exposure_ms", WorldPart::kExposure, 0, 33, " ms"},
    {"stamp_error_ms", WorldPart::kStamps, 0, 25, " ms"},
    {"mounting_deg", WorldPart::kMounting, 0, 15, " degrees"},
    {"drag_area_level", WorldPart::kDrag, 0, 20, " squares of the arm"},
    {"drag_area_axial", WorldPart::kDrag, 0, 20, " squares of the arm"},
    {"advance_ratio", WorldPart::kInflow, 0.3, 5, ""},
    {"thrust_coefficient", WorldPart::kInflow, 0.02, 0.5, ""},
    {"charge_low", WorldPart::kBattery, 0, 1, ""},
    {"charge_high", WorldPart::kBattery, 0, 1, ""},
    {"sag", WorldPart::kBattery, 0.001, 0.1, " of the voltage"},
    {"hover_s", WorldPart::kBattery, 10, 1e5, " s"},
};

bool has(const std::vector<WorldPart>& parts, WorldPart part) {
  const auto in = [&parts](WorldPart one) { return std::find(parts.begin(), parts.end(), one) != parts.end(); };
  return in(part) || (part != WorldPart::kFurniture && in(WorldPart::kHard));
}

Status check(const std::vector<WorldPart>& parts, const WorldSizesSpec& sizes) {
  for (const Size& size : kSizes) {
    const auto* field = WorldSizesSpec::descriptor()->FindFieldByName(size.field);
    if (!WorldSizesSpec::GetReflection()->HasField(sizes, field)) continue;
    const std::string name = std::string("world_sizes.") + size.field;
    const double value = WorldSizesSpec::GetReflection()->GetDouble(sizes, field);
    if (!(value >= size.low && value <= size.high))
      return Error::invalid(name, brief(value), brief(size.low) + " to " + brief(size.high) + size.unit);
    if (!has(parts, size.part))
      return Error::invalid(
          name, brief(value),
          "none: world has neither HARD nor " + WorldPartKind_Name(static_cast<WorldPartKind>(size.part)));
  }
  if (sizes.charge_low() > sizes.charge_high())
    return Error::invalid("world_sizes.charge_low", brief(sizes.charge_low()),
                          "at most charge_high, " + brief(sizes.charge_high()));
  return {};
}

/// @pre check(parts, sizes)
HardWorld convert(const std::vector<WorldPart>& parts, const WorldSizesSpec& sizes) {
  HardWorld world;
  world.parts = parts;
  if (has(parts, WorldPart::kDrift)) {
    world.estimate.drift_m_s = sizes.drift_m_s();
    world.estimate.drift_yaw_rad_s = sizes.drift_yaw_deg_s() * kDegree;
    world.estimate.drift_tilt_rad = sizes.drift_tilt_deg() * kDegree;
    world.estimate.drift_s = sizes.drift_s();
  }
  if (has(parts, WorldPart::kJumps)) {
    world.estimate.jumps_hz = sizes.jumps_hz();
    world.estimate.jump_m = sizes.jump_m();
    world.estimate.jump_yaw_rad = sizes.jump_yaw_deg() * kDegree;
  }
  if (has(parts, WorldPart::kLag)) world.estimate.lag = from_seconds(1e-3 * sizes.lag_ms());
  world.thrust_unknown = has(parts, WorldPart::kThrustUnknown);
  if (has(parts, WorldPart::kSlowCamera)) {
    world.camera_rate_hz = sizes.camera_rate_hz();
    world.camera.delay = from_seconds(1e-3 * sizes.frame_delay_ms());
  }
  if (has(parts, WorldPart::kExposure)) world.camera.exposure = from_seconds(1e-3 * sizes.exposure_ms());
  if (has(parts, WorldPart::kStamps)) world.camera.stamp_error = from_seconds(1e-3 * sizes.stamp_error_ms());
  if (has(parts, WorldPart::kMounting)) world.camera.mounting_rad = sizes.mounting_deg() * kDegree;
  if (has(parts, WorldPart::kDrag)) {
    world.air.drag_area_level = sizes.drag_area_level();
    world.air.drag_area_axial = sizes.drag_area_axial();
  }
  if (has(parts, WorldPart::kInflow)) {
    world.air.advance_ratio = sizes.advance_ratio();
    world.air.thrust_coefficient = sizes.thrust_coefficient();
  }
  if (has(parts, WorldPart::kBattery)) {
    world.air.charge_low = sizes.charge_low();
    world.air.charge_high = sizes.charge_high();
    world.air.sag = sizes.sag();
    world.air.hover_s = sizes.hover_s();
  }
  world.air.ground_effect = has(parts, WorldPart::kGroundEffect);
  world.furniture = has(parts, WorldPart::kFurniture);
  return world;
}

}  // namespace

const std::map<std::string, WorldPart>& world_part_names() {
  static const std::map<std::string, WorldPart> names = [] {
    std::map<std::string, WorldPart> made;
    for (int part = WorldPartKind_MIN; part <= WorldPartKind_MAX; ++part) {
      std::string name = WorldPartKind_Name(static_cast<WorldPartKind>(part));
      std::transform(name.begin(), name.end(), name.begin(),
                     [](unsigned char c) { return c == '_' ? '-' : static_cast<char>(std::tolower(c)); });
      made.emplace(std::move(name), static_cast<WorldPart>(part));
    }
    return made;
  }();
  return names;
}

Result<HardWorld> to_hard_world(const std::vector<WorldPart>& parts, const WorldSizesSpec& sizes) {
  if (auto status = check(parts, sizes); !status) return status.failure();
  return convert(parts, sizes);
}

HardWorld hard_world(const std::vector<WorldPart>& parts) { return convert(parts, WorldSizesSpec::default_instance()); }

std::string in_words(const std::vector<WorldPart>& parts) {
  std::string out;
  for (const auto& [name, part] : world_part_names())
    if (part != WorldPart::kEasy && std::find(parts.begin(), parts.end(), part) != parts.end())
      out += (out.empty() ? "" : ", ") + name;
  return out;
}

}  // namespace gatefield::config
