#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstddef>
#include <vector>

#include "common/scene/world.h"

/// Closed, smooth paths of flights: their shape, what they keep clear of, and how fast they can be flown. W: metres.
/// Not for use outside of this folder. Thread-safe: yes.
namespace gatefield::training {

/// A closed path in even steps of about 0.05 m.
struct Path {
  std::vector<Eigen::Vector3d> p_W;
  std::vector<Eigen::Vector3d> along;      ///< unit tangent
  std::vector<Eigen::Vector3d> curvature;  ///< second derivative by arc length
  double step_m = 0.05;                    ///< between points

  std::size_t size() const noexcept { return p_W.size(); }
};

/// Closed Hermite curve through the points, then rounded by a Gaussian of 0.5 m along the path, so that acceleration
/// has no jumps.
/// @param directions  unit tangents at the points
Path round_path(const std::vector<Eigen::Vector3d>& points, const std::vector<Eigen::Vector3d>& directions);

/// Whether the path stays at least `margin_m` away from the boxes, looked at every 0.1 m.
bool clear(const Path& path, const std::vector<scene::Box>& boxes, double margin_m);

/// Whether the path bends no sharper than a racer does, stays above the floor, and clear of the gates' frames and the
/// others.
bool flyable(const Path& path, const std::vector<scene::Gate>& gates, const std::vector<scene::Box>& others,
             double margin_m);

/// Speed at each point: `wanted_m_s`, less in curves (16 m/s^2 across the path), with room to slow down before and to
/// speed up after them (6 m/s^2 along it).
std::vector<double> plan_speed(const Path& path, double wanted_m_s);

/// Value between two entries of a closed list. @param at  index, not negative
template <typename T>
T between(const std::vector<T>& list, double at) {
  const double whole = std::floor(at);
  const std::size_t i = static_cast<std::size_t>(whole) % list.size();
  const double part = at - whole;
  return (1.0 - part) * list[i] + part * list[(i + 1) % list.size()];
}

}  // namespace gatefield::training
