#include "server/perception/gate_memory.h"

#include <algorithm>
#include <cmath>

#include "server/perception/gate_estimate.h"
#include "server/perception/hourglass_fit.h"
#include "server/planner/course_progress.h"

namespace gatefield::perception {
namespace {

/// A gate may be this far from its nominal waypoint; beyond it, what was seen is another gate.
constexpr double kFarthestFromNominal_m = 1.9;
/// A field that no hourglass explains better than this says nothing about a gate.
constexpr double kPoorFit_m = 0.16;

/// How much a frame's centre and axis can be trusted: grows with distance (held-out evaluation of the shipped model),
/// and with how badly an hourglass explains the field.
GateMeasurement measurement_of(const HourglassFit& fit, double distance_m) {
  GateMeasurement measurement;
  measurement.X_WG = fit.X_WG;
  measurement.center_sigma_m = std::hypot(0.02 + 0.012 * distance_m, fit.rms_m);
  measurement.axis_sigma_rad = std::hypot(0.04 + 0.015 * distance_m, 1.5 * fit.rms_m);
  return measurement;
}

}  // namespace

void DecodedField::evaluate(std::span<const float> x_W, std::span<const float> y_W, std::span<const float> z_W,
                            std::span<float> sdf_m) const noexcept {
  kernels::decode(decoder, x_W, y_W, z_W, sdf_m);
}

struct GateMemory::Entry {
  planner::GateBelief nominal;
  GateEstimate estimate;
  RememberedGate gate;
  DecodedField raw;  ///< scratch: the newest latent as captured, before it is aligned with the estimate
};

GateMemory::GateMemory(const model::Bundle& bundle, const protocol::Course& course)
    : bundle_(&bundle), course_(course) {
  const planner::CourseProgress progress(course);
  for (std::uint32_t i = 0; i < course.waypoints.size(); ++i) {
    auto entry = std::make_shared<Entry>();
    entry->nominal = progress.nominal(i);
    entry->gate.center_W = entry->nominal.center_W;
    entry->gate.axis_W = entry->nominal.axis_W;
    entries_.push_back(std::move(entry));
  }
}

Eigen::Vector3d GateMemory::expected_center_W(std::uint32_t waypoint) const noexcept {
  const Entry& entry = *entries_[waypoint];
  return entry.gate.seen ? entry.estimate.X_WG().translation() : entry.nominal.center_W;
}

bool GateMemory::seen(std::uint32_t waypoint) const noexcept { return entries_[waypoint]->gate.seen; }

GateMemory::Outcome GateMemory::observe(std::uint32_t waypoint, const Encoding& encoding, const Eigen::Isometry3d& X_WC,
                                        Stamp capture) {
  Entry& entry = *entries_[waypoint];
  const model::Manifest& manifest = bundle_->manifest();
  if (!(encoding.validity >= manifest.validity_threshold)) return Outcome::kNotValid;

  kernels::fold(bundle_->decoder(), encoding.latent, X_WC, &entry.raw.decoder);
  const bool has_center = bundle_->decoder().kind == model::DecoderKind::kHyper;
  const Eigen::Vector3d around_W =
      has_center ? Eigen::Vector3d(X_WC * encoding.center_C.cast<double>()) : expected_center_W(waypoint);
  const Eigen::Vector3d axis_W = entry.gate.seen ? entry.gate.axis_W : entry.nominal.axis_W;
  HourglassFit fit = fit_hourglass(entry.raw, course_.gate, manifest.cone_angle_rad, around_W, axis_W);
  if (!fit.ok || fit.rms_m > kPoorFit_m) return Outcome::kPoorFit;
  if ((fit.X_WG.translation() - entry.nominal.center_W).norm() > kFarthestFromNominal_m) return Outcome::kOutlier;
  if (fit.X_WG.linear().col(0).dot(entry.nominal.axis_W) < 0) {  // the passing direction is the course's
    fit.X_WG.linear().col(0) *= -1.0;
    fit.X_WG.linear().col(1) *= -1.0;
  }

  const double distance_m = (fit.X_WG.translation() - X_WC.translation()).norm();
  if (!entry.estimate.update(measurement_of(fit, distance_m), capture)) return Outcome::kOutlier;

  // The newest field, moved by what separates this frame's fit from the estimate over all frames.
  const Eigen::Isometry3d correction = entry.estimate.X_WG() * fit.X_WG.inverse();
  kernels::fold(bundle_->decoder(), encoding.latent, correction * X_WC, &entry.gate.field.decoder);
  entry.gate.seen = true;
  entry.gate.stamp = capture;
  entry.gate.center_W = entry.estimate.X_WG().translation();
  entry.gate.axis_W = entry.estimate.X_WG().linear().col(0);
  entry.gate.center_sigma_m = entry.estimate.center_sigma_m();
  entry.gate.axis_sigma_rad = entry.estimate.axis_sigma_rad();
  return Outcome::kTaken;
}

void GateMemory::snapshot(std::uint32_t target, std::uint32_t next, MemorySnapshot* out) const {
  out->target = target;
  out->gates[0] = entries_[target]->gate;
  out->gates[1] = entries_[next]->gate;
}

}  // namespace gatefield::perception
