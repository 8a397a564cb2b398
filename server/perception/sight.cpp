#include "server/perception/sight.h"

#include <optional>
#include <utility>

#include "server/gates/gate_size.h"

namespace gatefield::perception {

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
    : camera_(camera),
      sensor_(std::move(sensor)),
      options_(options),
      records_(course),
      watch_(camera, &records_.passages(), options.first_sight_tolerance_m) {}

Sight::Outcome Sight::look(std::span<const std::uint8_t> pixels, protocol::DepthEncoding encoding, Stamp capture,
                           const Eigen::Isometry3d& X_WB, std::uint32_t target, std::uint32_t next) {
  const WireImage image{pixels, encoding};
  const DecodedDepth decoded = decode_depth(image, camera_, &depth_m_);
  const View view{depth_m_, camera_, X_WB * camera_.X_BC};
  WatchedFrame watched{image, decoded, capture, view.X_WC, target};
  const gates::Expectation gate = records_.expectation(target);
  if (decoded.returns > 0) {
    const Search search = look_for(target, true, view, capture);
    watched.taken = search.taken;
    if (search.seen) watched.seen_W = search.seen->gate.X_WG.translation();
    const gates::Passages& passages = records_.passages();
    if (passages.gate(next) != passages.gate(target))
      watched.taken = look_for(next, false, view, capture).taken || watched.taken;
  }
  watched.expected = !records_.seen(target) && camera_.sees(view.X_WC.inverse() * gate.center_W);
  watch_.watch(watched, gate, sensor_.get());
  if (decoded.returns > 0) return Outcome::kLooked;
  return decoded.saturated > 0 ? Outcome::kSaturated : Outcome::kEmpty;
}

Sight::Search Sight::look_for(std::uint32_t waypoint, bool is_target, const View& view, Stamp capture) {
  const gates::Expectation gate = records_.expectation(waypoint);
  const double size = gates::gate_size(gate.shape);
  const Eigen::Vector3d expected_C = view.X_WC.inverse() * gate.center_W;
  const bool in_view = camera_.sees(expected_C, -options_.view_margin_px_per_width * camera_.width_px);
  // A displaced gate may be in view although its waypoint is not.
  const bool searching = is_target && !gate.seen && expected_C.norm() <= size * options_.first_sight_distance_m;
  if (!in_view && !searching) return {};

  Search search;
  // A sensor can't be steered to a point beside or behind the camera.
  if (in_view || !sensor_->steerable()) {
    search.seen = sensor_->look(view, gate, Where::kExpected);
    search.taken = search.seen && remember(*search.seen, waypoint, capture, sensor_.get(), &records_);
    if (search.taken) return search;
  }
  if (gate.seen || !is_target || !sensor_->steerable()) return search;
  // The waypoint is only about where the gate is: look at the whole image once, and keep what is near enough. (Not for
  // the gate after the target: the nearest gate in view, which this finds, is the target then.)
  search.seen = sensor_->look(view, gate, Where::kAnywhere);
  if (!search.seen) return search;
  const Eigen::Vector3d nominal_W = records_.passages().nominal(waypoint).center_W;
  if ((search.seen->glimpse_W - nominal_W).norm() <= size * options_.first_sight_tolerance_m)
    search.taken = remember(*search.seen, waypoint, capture, sensor_.get(), &records_);
  return search;
}

}  // namespace gatefield::perception
