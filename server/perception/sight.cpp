#include "server/perception/sight.h"

#include <bit>
#include <cstring>
#include <limits>
#include <optional>
#include <utility>

namespace gatefield::perception {
namespace {

// The wire is little endian; so is every machine this is built for.
static_assert(std::endian::native == std::endian::little);

}  // namespace

DecodedDepth decode_depth(std::span<const std::uint8_t> pixels, protocol::DepthEncoding encoding,
                          const CameraModel& camera, std::vector<float>* depth_m) {
  const std::size_t count = pixels.size() / protocol::bytes_per_pixel(encoding);
  const auto nearest = static_cast<float>(camera.min_depth_m);
  const auto farthest = static_cast<float>(camera.max_depth_m);
  depth_m->resize(count);
  DecodedDepth result;
  const auto take = [&](std::size_t i, float z, bool at_end) {
    if (z > farthest || at_end) ++result.saturated;
    const bool good = z >= nearest && z <= farthest;  // false for NaN
    result.returns += good ? 1 : 0;
    (*depth_m)[i] = good ? z : 0.0f;
  };
  if (encoding == protocol::DepthEncoding::kCounts16) {
    for (std::size_t i = 0; i < count; ++i) {
      std::uint16_t mm;
      std::memcpy(&mm, pixels.data() + 2 * i, sizeof mm);
      take(i, 1e-3f * static_cast<float>(mm), mm == std::numeric_limits<std::uint16_t>::max());
    }
  } else {
    for (std::size_t i = 0; i < count; ++i) {
      float z;
      std::memcpy(&z, pixels.data() + 4 * i, sizeof z);
      take(i, z, false);
    }
  }
  return result;
}

bool remember(const Observation& seen, std::uint32_t waypoint, Stamp capture, GateSensor* sensor,
              gates::GateRecords* records) {
  gates::GateMeasurement measurement = seen.gate;
  const std::optional<Eigen::Isometry3d> X_WG = records->take(waypoint, &measurement, capture);
  if (!X_WG) return false;
  records->set_field(waypoint, sensor->field(measurement.X_WG, *X_WG, records->passages().nominal(waypoint).shape));
  return true;
}

Sight::Sight(const CameraModel& camera, const Course& course, std::unique_ptr<GateSensor> sensor,
             const SightOptions& options)
    : camera_(camera), sensor_(std::move(sensor)), options_(options), records_(course) {}

Sight::Outcome Sight::look(std::span<const std::uint8_t> pixels, protocol::DepthEncoding encoding, Stamp capture,
                           const Eigen::Isometry3d& X_WB, std::uint32_t target, std::uint32_t next) {
  const DecodedDepth decoded = decode_depth(pixels, encoding, camera_, &depth_m_);
  if (decoded.returns == 0) return decoded.saturated > 0 ? Outcome::kSaturated : Outcome::kEmpty;
  const View view{depth_m_, camera_, X_WB * camera_.X_BC};
  look_for(target, true, view, capture);
  const gates::Passages& passages = records_.passages();
  if (passages.gate(next) != passages.gate(target)) look_for(next, false, view, capture);
  return Outcome::kLooked;
}

void Sight::look_for(std::uint32_t waypoint, bool is_target, const View& view, Stamp capture) {
  const gates::Expectation gate = records_.expectation(waypoint);
  const Eigen::Vector3d expected_C = view.X_WC.inverse() * gate.center_W;
  const bool in_view = camera_.sees(expected_C, -options_.view_margin_px_per_width * camera_.width_px);
  // A displaced gate may be in view although its waypoint is not.
  const bool searching = is_target && !gate.seen && expected_C.norm() <= options_.first_sight_distance_m;
  if (!in_view && !searching) return;

  // A sensor can't be steered to a point beside or behind the camera.
  if (in_view || !sensor_->steerable()) {
    const auto seen = sensor_->look(view, gate, Where::kExpected);
    if (seen && remember(*seen, waypoint, capture, sensor_.get(), &records_)) return;
  }
  if (gate.seen || !is_target || !sensor_->steerable()) return;
  // The waypoint is only about where the gate is: look at the whole image once, and keep what is near enough. (Not for
  // the gate after the target: the nearest gate in view, which this finds, is the target then.)
  const auto seen = sensor_->look(view, gate, Where::kAnywhere);
  if (!seen) return;
  const Eigen::Vector3d nominal_W = records_.passages().nominal(waypoint).center_W;
  if ((seen->glimpse_W - nominal_W).norm() > options_.first_sight_tolerance_m) return;
  remember(*seen, waypoint, capture, sensor_.get(), &records_);
}

}  // namespace gatefield::perception
