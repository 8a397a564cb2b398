#include "client/simulator/snapshot_keeper.h"

#include <cmath>

namespace gatefield::simulator {
namespace {

constexpr double kBestDistance_m = 3.5;

}  // namespace

SnapshotKeeper::SnapshotKeeper(std::vector<scene::Gate> gates, const CameraModel& camera)
    : gates_(std::move(gates)), camera_(camera) {}

void SnapshotKeeper::offer(const scene::DepthImage& depth, const Eigen::Isometry3d& X_WB, int waypoint,
                           std::size_t passes, double t_s) {
  const scene::Gate& gate = gates_[static_cast<std::size_t>(waypoint)];
  const Eigen::Isometry3d X_WC = X_WB * camera_.X_BC;
  const Eigen::Vector3d p_CG = X_WC.inverse() * gate.X_WG.translation();
  const bool visible = camera_.sees(p_CG, 0.15 * camera_.height_px);
  const double off_m = std::abs(p_CG.z() - kBestDistance_m);
  const int rank = !visible ? 0 : off_m > 1.0 ? 1 : passes == 0 ? 2 : 3;
  if (rank < rank_ || (rank == rank_ && off_m >= off_m_)) return;
  rank_ = rank;
  off_m_ = off_m;
  kept_ = Snapshot{depth, camera_, X_WC, waypoint, gate, t_s};
}

}  // namespace gatefield::simulator
