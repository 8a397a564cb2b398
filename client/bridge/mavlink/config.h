#pragma once

#include <cstdint>
#include <string>

#include "client/bridge/mavlink/dialect.h"
#include "client/bridge/mavlink/odometer.h"
#include "client/bridge/mavlink/radio.h"
#include "client/bridge/mavlink/time_sync.h"
#include "client/flight/thrust_estimate.h"
#include "common/base/result.h"
#include "common/vehicle/quadrotor.h"

namespace gatefield::bridge {

/// Where stamps of states come from.
enum class Stamps : std::uint8_t {
  kTimeSync,  ///< the autopilot's, translated by TIMESYNC
  kArrival,   ///< the time of arrival less `link_delay`, for autopilots that answer no TIMESYNC
};

struct MavlinkConfig {
  std::string link = "udp-listen:0.0.0.0:14540";  ///< firmware::parse_address()
  Dialect dialect = Dialect::kPx4;
  std::uint8_t own_system = 255;     ///< 1 to 255; ArduPilot minds the heartbeats of 255 alone (SYSID_MYGCS)
  std::uint8_t own_component = 191;  ///< 1 to 255; 191 is an onboard computer
  std::uint8_t vehicle_system = 0;   ///< whom to fly; 0: the first autopilot that is heard
  double setpoint_rate_hz = 100.0;   ///< of the loop, and of SET_ATTITUDE_TARGET; 20 to 500
  double state_rate_hz = 100.0;      ///< asked of the autopilot (SET_MESSAGE_INTERVAL); 20 to 500
  Stamps stamps = Stamps::kTimeSync;
  Stamp link_delay{0};  ///< of Stamps::kArrival; 0 to 200 ms
  TimeSyncOptions time_sync;
  OdometerOptions state;
  RadioSwitches radio;  ///< channels of RC_CHANNELS
  /// False: the person's radio arms and nobody else; the bridge asks for the mode when that is done.
  bool arm_by_command = false;
  /// True: GUID_OPTIONS is written where its bit for thrust is missing.
  bool may_set_parameters = false;
  flight::ThrustOptions thrust;
  QuadrotorModel quadrotor;
  Stamp connect_timeout{std::chrono::seconds(10)};  ///< until the first heartbeat; 100 ms to 10 min
};

/// Says which field is wrong and why.
Status validate(const MavlinkConfig& config);
/// Parts of it that every way to an autopilot has: "link_delay", "connect_timeout".
Status validate_link(Stamp link_delay, Stamp connect_timeout);
/// One of the two arms: "arm_by_command".
Status validate_arming(bool arm_by_command, const RadioSwitches& radio);

}  // namespace gatefield::bridge
