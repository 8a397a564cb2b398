#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "common/course/course.h"

namespace gatefield::sdk {

/// Keeps a vehicle that flies by itself clear of the gates it knows: the course's, where they are nominally. The margin
/// stands for the vehicle's radius and for how far a gate may be from there.
///
/// Two things are said, both level and of a bounded size; who flies adds them to what it does otherwise. A third says
/// when braking is no way out:
///   - drift(): slowly out of the space before, in and behind a gate, along its axis. Needed before hovering and
///     descending: a frame is below whoever hovers in or above it.
///   - steer(): at speed, sideways away from a frame that lies where the velocity leads, into the opening or around the
///     gate, whichever is nearer. Enough for d = a t^2 / 2; what is too near for that is hit.
///   - passes(): a gate is so near that whoever has a plan through it does better to fly it.
/// Thread-safe: yes (const).   Real-time safe: yes (the constructor allocates).
class KeepClear {
 public:
  static constexpr double kDrift_m_s = 0.8;  ///< at the gate, falling to 0 at the edge of its space
  static constexpr double kMaxSteer_m_s2 = 4.0;
  static constexpr double kAhead_s = 1.2;  ///< frames farther ahead are none yet

  /// @pre validate(course)   @param margin_m  from the frame to the vehicle's centre, more than 0
  KeepClear(const Course& course, double margin_m);

  /// Velocity that leads out of the space of the gate that is nearest, W, m/s; zero outside of all of them.
  /// @param sinking  the space goes on upwards without end: a descent must not begin above a gate
  Eigen::Vector2d drift(const Eigen::Vector3d& p_W, bool sinking) const noexcept;
  /// Acceleration across the velocity, W, m/s^2; zero where the way is free.
  Eigen::Vector2d steer(const Eigen::Vector3d& p_W, const Eigen::Vector3d& v_W) const noexcept;

  /// Whether a gate's plane is crossed within `time_s`, at or near its opening, by who goes straight on; or is being
  /// crossed now.
  bool passes(const Eigen::Vector3d& p_W, const Eigen::Vector3d& v_W, double time_s) const noexcept;

 private:
  struct Gate {
    Eigen::Isometry3d X_GW;
    Eigen::Vector2d axis_W, left_W;  // G's x and y, level
    double inner_m, outer_m;         // half widths
  };
  std::vector<Gate> gates_;
  double margin_m_;
};

}  // namespace gatefield::sdk
