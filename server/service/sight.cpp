#include "server/service/sight.h"

#include <bit>
#include <cstring>
#include <limits>
#include <optional>

namespace gatefield::service {
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
  if (encoding == protocol::DepthEncoding::kMillimetres16) {
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

Sight::Sight(const CameraModel& camera, const Course& course, std::unique_ptr<Memory> memory,
             const SightOptions& options)
    : camera_(camera), course_(course), memory_(std::move(memory)), options_(options) {}

Sight::Outcome Sight::look(std::span<const std::uint8_t> pixels, protocol::DepthEncoding encoding, Stamp capture,
                           const Eigen::Isometry3d& X_WB, std::uint32_t target, std::uint32_t next,
                           perception::DepthEncoder& encoder) {
  const DecodedDepth decoded = decode_depth(pixels, encoding, camera_, &depth_m_);
  if (decoded.returns == 0) return decoded.saturated > 0 ? Outcome::kSaturated : Outcome::kEmpty;
  const Eigen::Isometry3d X_WC = X_WB * camera_.X_BC;
  look_for(target, true, X_WC, capture, encoder);
  if (next != target) look_for(next, false, X_WC, capture, encoder);
  return Outcome::kLooked;
}

void Sight::look_for(std::uint32_t waypoint, bool is_target, const Eigen::Isometry3d& X_WC, Stamp capture,
                     perception::DepthEncoder& encoder) {
  const Eigen::Isometry3d X_CW = X_WC.inverse();
  const Eigen::Vector3d expected_C = X_CW * memory_->expected_center_W(waypoint);
  const bool seen = memory_->seen(waypoint);
  const bool in_view = camera_.sees(expected_C, -options_.view_margin_px_per_width * camera_.width_px);
  // A displaced gate may be in view although its waypoint is not.
  const bool searching = is_target && !seen && expected_C.norm() <= options_.first_sight_distance_m;
  if (!in_view && !searching) return;

  const auto shows_gate = [&](const std::optional<perception::Encoding>& encoding) {
    return encoding && encoding->validity >= options_.validity_threshold;
  };
  // A point beside or behind the camera would crop at nothing.
  if (in_view || !options_.takes_prior) {
    const auto encoding = encoder.encode(depth_m_, camera_, expected_C);
    if (encoding && memory_->observe(waypoint, *encoding, X_WC, capture) == perception::GateMemory::Outcome::kTaken)
      return;
  }
  if (seen || !is_target || !options_.takes_prior) return;
  // The waypoint is only about where the gate is: look at the whole image once, and keep what is near enough. (Not for
  // the gate after the target: the nearest gate in view, which this finds, is the target then.)
  const auto encoding = encoder.encode(depth_m_, camera_, std::nullopt);
  if (!shows_gate(encoding)) return;
  const Eigen::Vector3d center_W = X_WC * encoding->center_C.cast<double>();
  if ((center_W - course_.waypoints[waypoint].p_W).norm() > options_.first_sight_tolerance_m) return;
  memory_->observe(waypoint, *encoding, X_WC, capture);
}

}  // namespace gatefield::service
