#include "server/perception/gate_memory.h"

#include <algorithm>
#include <cmath>

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
  if (stand_in) return stand_in->evaluate(x_W, y_W, z_W, sdf_m);
  decoder.decode(x_W, y_W, z_W, sdf_m);
}

struct GateRecords::Record {
  planner::GateBelief nominal;
  GateEstimate estimate;
  RememberedGate gate;
};

GateRecords::GateRecords(const Course& course) {
  const planner::CourseProgress progress(course);
  for (std::uint32_t i = 0; i < course.waypoints.size(); ++i) {
    auto record = std::make_unique<Record>();
    record->nominal = progress.nominal(i);
    record->gate.center_W = record->nominal.center_W;
    record->gate.axis_W = record->nominal.axis_W;
    records_.push_back(std::move(record));
  }
}

GateRecords::~GateRecords() = default;

const planner::GateBelief& GateRecords::nominal(std::uint32_t waypoint) const noexcept {
  return records_[waypoint]->nominal;
}

Eigen::Vector3d GateRecords::expected_center_W(std::uint32_t waypoint) const noexcept {
  const Record& record = *records_[waypoint];
  return record.gate.seen ? record.estimate.X_WG().translation() : record.nominal.center_W;
}

bool GateRecords::seen(std::uint32_t waypoint) const noexcept { return records_[waypoint]->gate.seen; }

RememberedGate& GateRecords::gate(std::uint32_t waypoint) noexcept { return records_[waypoint]->gate; }

std::optional<Eigen::Isometry3d> GateRecords::take(std::uint32_t waypoint, GateMeasurement* measurement,
                                                   Stamp capture) noexcept {
  Record& record = *records_[waypoint];
  Eigen::Isometry3d& X_WG = measurement->X_WG;
  if ((X_WG.translation() - record.nominal.center_W).norm() > kFarthestFromNominal_m) return std::nullopt;
  if (X_WG.linear().col(0).dot(record.nominal.axis_W) < 0) {  // the passing direction is the course's
    X_WG.linear().col(0) *= -1.0;
    X_WG.linear().col(1) *= -1.0;
  }
  if (!record.estimate.update(*measurement, capture)) return std::nullopt;
  RememberedGate& gate = record.gate;
  gate.seen = true;
  gate.stamp = capture;
  gate.center_W = record.estimate.X_WG().translation();
  gate.axis_W = record.estimate.X_WG().linear().col(0);
  gate.center_sigma_m = record.estimate.center_sigma_m();
  gate.axis_sigma_rad = record.estimate.axis_sigma_rad();
  return record.estimate.X_WG();
}

void GateRecords::snapshot(std::uint32_t target, std::uint32_t next, MemorySnapshot* out) const {
  out->target = target;
  out->gates[0] = records_[target]->gate;
  out->gates[1] = records_[next]->gate;
}

GateMemory::GateMemory(const model::Bundle& bundle, std::shared_ptr<const kernels::PreparedDecoder> decoder,
                       const Course& course)
    : bundle_(&bundle), decoder_(std::move(decoder)), records_(course) {
  for (const Waypoint& waypoint : course.waypoints) shapes_.push_back(waypoint.gate);
}

Eigen::Vector3d GateMemory::expected_center_W(std::uint32_t waypoint) const noexcept {
  return records_.expected_center_W(waypoint);
}

bool GateMemory::seen(std::uint32_t waypoint) const noexcept { return records_.seen(waypoint); }

GateMemory::Outcome GateMemory::observe(std::uint32_t waypoint, const Encoding& encoding, const Eigen::Isometry3d& X_WC,
                                        Stamp capture) {
  const model::Manifest& manifest = bundle_->manifest();
  if (!(encoding.validity >= manifest.validity_threshold)) return Outcome::kNotValid;

  kernels::fold(decoder_, encoding.latent, X_WC, &raw_.decoder);
  const bool has_center = bundle_->decoder().kind == model::DecoderKind::kHyper;
  const Eigen::Vector3d around_W =
      has_center ? Eigen::Vector3d(X_WC * encoding.center_C.cast<double>()) : expected_center_W(waypoint);
  RememberedGate& gate = records_.gate(waypoint);  // as the course has it until it is seen
  const HourglassFit fit = fit_hourglass(raw_, shapes_[waypoint], manifest.cone_angle_rad, around_W, gate.axis_W);
  if (!fit.ok || fit.rms_m > kPoorFit_m) return Outcome::kPoorFit;

  const double distance_m = (fit.X_WG.translation() - X_WC.translation()).norm();
  GateMeasurement measurement = measurement_of(fit, distance_m);
  const std::optional<Eigen::Isometry3d> X_WG = records_.take(waypoint, &measurement, capture);
  if (!X_WG) return Outcome::kOutlier;

  // The newest field, moved by what separates this frame's fit from the estimate over all frames.
  const Eigen::Isometry3d correction = *X_WG * measurement.X_WG.inverse();
  gate.field.decoder = raw_.decoder;
  gate.field.decoder.place(correction * X_WC);
  return Outcome::kTaken;
}

void GateMemory::snapshot(std::uint32_t target, std::uint32_t next, MemorySnapshot* out) const {
  records_.snapshot(target, next, out);
}

}  // namespace gatefield::perception
