#include "client/race/tune/objective.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "client/race/summary.h"

namespace gatefield::race {
namespace {

constexpr double kLostShare = 0.5;
constexpr double kClearanceShare = 0.3, kTimeShare = 0.2;
constexpr double kSmallestClearance_m = 0.02;

/// Half of what a passage through the middle of the narrowest gate leaves.
double plenty_m(const Cell& cell) {
  double narrowest_m = std::numeric_limits<double>::infinity();
  for (const Waypoint& waypoint : cell.scenario.track.course.waypoints)
    narrowest_m = std::min(narrowest_m, waypoint.gate.inner_half_m);
  return std::max(kSmallestClearance_m, 0.5 * (narrowest_m - cell.scenario.vehicle.quadrotor.collision_radius_m));
}

/// Where gate `passed` of a race stands, nominally; -1: where it starts.
Eigen::Vector3d place_W(const Cell& cell, int passed) {
  const auto& waypoints = cell.scenario.track.course.waypoints;
  if (passed < 0) return cell.scenario.track.start_p_WB;
  return waypoints[static_cast<std::size_t>(passed) % waypoints.size()].p_W;
}

}  // namespace

double course_length_m(const Cell& cell) {
  const Course& course = cell.scenario.track.course;
  const int gates = course.laps * static_cast<int>(course.waypoints.size());
  double length_m = 0.0;
  for (int i = 0; i < gates; ++i) length_m += (place_W(cell, i) - place_W(cell, i - 1)).norm();
  return length_m;
}

double score(const Cell& cell, const TrialResult& result) {
  if (!result.won()) {
    const double all = std::max(result.gates_total, 1);
    const Eigen::Vector3d next_W = place_W(cell, result.gates_passed);
    const double way_m = (next_W - place_W(cell, result.gates_passed - 1)).norm();
    const double left_m = (next_W - result.end_p_W).norm();
    const double part = way_m > 0.0 && std::isfinite(left_m) ? std::clamp(1.0 - left_m / way_m, 0.0, 1.0) : 0.0;
    return kLostShare * std::min(1.0, (result.gates_passed + part) / all);
  }
  // Never near a frame is as far as can be.
  const double clearance = std::isfinite(result.clearance_m) ? result.clearance_m / plenty_m(cell) : 1.0;
  const double time = course_length_m(cell) / result.speed_m_s / std::max(result.time_s, 1e-3);
  return 1.0 + kClearanceShare * std::clamp(clearance, 0.0, 1.0) + kTimeShare * std::clamp(time, 0.0, 1.0);
}

Score summarize_scores(const Campaign& races, const std::vector<TrialResult>& results) {
  Score out;
  std::vector<double> clearances, times;
  double sum = 0.0;
  for (const TrialResult& result : results) {
    ++out.trials;
    sum += score(*races.find(result.cell), result);
    if (!result.won()) continue;
    ++out.won;
    clearances.push_back(result.clearance_m);
    times.push_back(result.time_s);
  }
  out.mean = out.trials > 0 ? sum / static_cast<double>(out.trials) : std::numeric_limits<double>::quiet_NaN();
  out.clearance_m = median_of(clearances);
  out.time_s = median_of(times);
  return out;
}

double sign_test(std::size_t ups, std::size_t downs) {
  const auto n = static_cast<double>(ups + downs);
  const auto fewer = static_cast<double>(std::min(ups, downs));
  double tail = 0.0;
  for (double k = 0.0; k <= fewer; ++k)
    tail += std::exp(std::lgamma(n + 1.0) - std::lgamma(k + 1.0) - std::lgamma(n - k + 1.0) - n * std::log(2.0));
  return std::min(1.0, 2.0 * tail);
}

}  // namespace gatefield::race
