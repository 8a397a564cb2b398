#pragma once

#include <Eigen/Core>
#include <optional>

#include "client/flight/state_check.h"
#include "common/base/clock.h"
#include "common/base/result.h"

namespace gatefield::flight {

/// A box in the world frame that the vehicle stays in.
struct Fence {
  Eigen::Vector3d low_W = Eigen::Vector3d::Constant(-1e3);
  Eigen::Vector3d high_W = Eigen::Vector3d::Constant(1e3);

  bool holds(const Eigen::Vector3d& p_W) const noexcept {
    return (p_W.array() >= low_W.array()).all() && (p_W.array() <= high_W.array()).all();
  }
};

/// Who may have the motors started.
enum class ArmBy {
  kSwitch,  ///< the person's arm switch: off, then on, while all checks pass
  kItself,  ///< the supervisor, once, as soon as all checks pass: only for who says so explicitly (simulators)
};

/// Bounds and times of the supervisor. All can be told; validate() says what each may be.
struct SupervisorOptions {
  ArmBy arm_by = ArmBy::kSwitch;
  // What must be there before arming, unless told otherwise.
  bool needs_pilot = true;  ///< a person's radio is heard; it is watched in flight, too
  bool needs_field = true;  ///< the server has seen the first gate
  bool needs_depth = true;  ///< depth frames reach the server; false: no camera, gates as the course has them
  bool needs_firmware_failsafe = true;  ///< the firmware's failsafe was read back and is good

  StateCheckOptions state;
  Stamp state_settles = std::chrono::milliseconds(500);      ///< good states for this long are a state again
  Stamp state_doubted = std::chrono::milliseconds(500);      ///< contradicting for this long they are wrong
  Stamp round_trip_max = std::chrono::milliseconds(150);     ///< state out to plan in, before arming
  Stamp controller_silent = std::chrono::milliseconds(500);  ///< the controller's last word is older
  Stamp pilot_silent = std::chrono::seconds(1);              ///< the radio was not heard for so long

  std::optional<Fence> fence;                          ///< empty: none
  Stamp fence_ahead = std::chrono::milliseconds(300);  ///< looks where the velocity leads in this time

  double battery_arm_v = 0.0;                   ///< less does not arm; 0: not watched
  double battery_land_v = 0.0;                  ///< less lands; 0: not watched
  Stamp battery_low = std::chrono::seconds(1);  ///< for so long: full throttle sags for a moment

  double take_off_height_m = 1.0;  ///< above where it stood
  double take_off_speed_m_s = 0.6;
  Stamp take_off_limit = std::chrono::seconds(8);

  Stamp outage_short = std::chrono::milliseconds(300);  ///< plans back within this: the race goes on at once
  Stamp plan_settles = std::chrono::seconds(1);         ///< after a longer one they must come for so long
  Stamp hand_over = std::chrono::seconds(1);            ///< and take over little by little in this time
  double stopped_m_s = 0.5;                             ///< slower is stopped
  Stamp brake_limit = std::chrono::seconds(5);
  Stamp hold_limit = std::chrono::seconds(10);
  double descent_m_s = 0.5;
  Stamp descent_limit = std::chrono::seconds(60);

  double level_thrust = 0.92;                   ///< of the weight, while there is no state
  Stamp level_limit = std::chrono::seconds(5);  ///< then the motors go off

  Stamp arming_limit = std::chrono::seconds(3);
  Stamp disarm_limit = std::chrono::seconds(3);
  Stamp give_back = std::chrono::milliseconds(300);  ///< switches rest for so long before the vehicle is taken

  /// Roll and pitch of the states and of the flight controller farther apart than this for half a second on the ground:
  /// one of them is wrong, and it does not arm any more. More than pi: not watched.
  double tilt_apart_rad = 0.26;

  double gate_margin_m = 0.4;  ///< kept from gates beyond the vehicle's radius: how well their places are known
};

/// Says which field is wrong and why, with what it may be.
Status validate(const SupervisorOptions& options);

}  // namespace gatefield::flight
