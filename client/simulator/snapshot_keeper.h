#pragma once

#include <optional>
#include <vector>

#include "client/simulator/run_log.h"

namespace gatefield::simulator {

/// Keeps the frame that shows best what the planner works from: a gate in full view a few metres ahead, on the way and
/// not at the start.
/// Thread-safe: no.   Real-time safe: no (copies images).
class SnapshotKeeper {
 public:
  /// @param gates  as they are passed, by waypoint (config::gates_by_waypoint)
  SnapshotKeeper(std::vector<scene::Gate> gates, const CameraModel& camera);

  /// @param X_WB      true pose of the body at the capture
  /// @param waypoint  the one that is next, index
  /// @param passes    gates passed so far
  void offer(const scene::DepthImage& depth, const Eigen::Isometry3d& X_WB, int waypoint, std::size_t passes,
             double t_s);

  std::optional<Snapshot> take() { return std::move(kept_); }

 private:
  std::vector<scene::Gate> gates_;
  CameraModel camera_;
  int rank_ = -1;
  double off_m_ = 0.0;
  std::optional<Snapshot> kept_;
};

}  // namespace gatefield::simulator
