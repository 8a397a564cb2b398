#include "server/gates/gate_records.h"

#include "server/gates/gate_size.h"

namespace gatefield::gates {
namespace {

/// The usual gate (gate_size()) may be this far from its nominal waypoint; beyond it, what was seen is another gate.
constexpr double kFarthestFromNominal_m = 1.9;

}  // namespace

GateRecords::GateRecords(const Course& course) : passages_(course), records_(passages_.gates()) {
  for (std::uint32_t i = passages_.waypoints(); i-- > 0;) {  // the first passage of a gate has the last word
    RememberedGate& gate = record(i).gate;
    gate.center_W = passages_.nominal(i).center_W;
    gate.axis_W = passages_.nominal(i).axis_W;
  }
}

Expectation GateRecords::expectation(std::uint32_t waypoint) const noexcept {
  const GateBelief& nominal = passages_.nominal(waypoint);
  const Record& known = record(waypoint);
  Expectation expectation;
  expectation.gate = passages_.gate(waypoint);
  expectation.shape = nominal.shape;
  expectation.seen = known.gate.seen;
  expectation.center_W = known.gate.seen ? known.gate.center_W : nominal.center_W;
  expectation.axis_W = known.gate.seen ? passages_.turned(waypoint, known.gate.axis_W) : nominal.axis_W;
  return expectation;
}

std::optional<Eigen::Isometry3d> GateRecords::take(std::uint32_t waypoint, GateMeasurement* measurement,
                                                   Stamp capture) noexcept {
  const GateBelief& nominal = passages_.nominal(waypoint);
  Record& known = record(waypoint);
  Eigen::Isometry3d& X_WG = measurement->X_WG;
  const double size = gate_size(nominal.shape);
  if ((X_WG.translation() - nominal.center_W).norm() > size * kFarthestFromNominal_m) return std::nullopt;
  // The passing direction is the course's; the record keeps it as the gate's first passage has it.
  if (X_WG.linear().col(0).dot(passages_.turned(waypoint, nominal.axis_W)) < 0) {
    X_WG.linear().col(0) *= -1.0;
    X_WG.linear().col(1) *= -1.0;
  }
  if (!known.estimate.update(*measurement, capture, size)) return std::nullopt;
  RememberedGate& gate = known.gate;
  gate.seen = true;
  gate.stamp = capture;
  gate.center_W = known.estimate.X_WG().translation();
  gate.axis_W = known.estimate.X_WG().linear().col(0);
  gate.center_sigma_m = known.estimate.center_sigma_m();
  gate.axis_sigma_rad = known.estimate.axis_sigma_rad();
  return known.estimate.X_WG();
}

void GateRecords::snapshot(std::uint32_t target, std::uint32_t next, Snapshot* out) const noexcept {
  out->waypoint = {target, next};
  out->gates[0] = record(target).gate;
  out->gates[1] = record(next).gate;
}

}  // namespace gatefield::gates
