#pragma once

#include <cstdint>

#include "client/bridge/mavlink/config.h"
#include "client/bridge/mavlink/odometer.h"
#include "client/bridge/mavlink/radio.h"
#include "client/bridge/px4/stamp_check.h"
#include "client/flight/thrust_estimate.h"
#include "common/base/result.h"
#include "common/dds/px4/layout.h"
#include "common/vehicle/quadrotor.h"

namespace gatefield::bridge {

/// Where the person's switches are read.
enum class RadioFrom : std::uint8_t {
  kInputRc,        ///< topic input_rc: the radio's channels
  kManualControl,  ///< topic manual_control_setpoint: knobs aux1 to aux6, as channels 1 to 6, -1 to 1 as 1000 to 2000 us
};

struct Px4Config {
  px4::BusOptions bus;
  std::uint8_t own_system = 1;        ///< 1 to 255: as whom commands are sent
  std::uint16_t own_component = 191;  ///< 1 to 65535; 191 is an onboard computer
  std::uint8_t vehicle_system = 0;    ///< PX4's MAV_SYS_ID; 0: of the first that is heard
  double setpoint_rate_hz = 100.0;    ///< of the loop, and of setpoints; 20 to 500
  Stamps stamps = Stamps::kTimeSync;  ///< kTimeSync: PX4's, of its agent's wall clock (StampCheck)
  Stamp link_delay{0};                ///< of Stamps::kArrival; 0 to 200 ms
  StampOptions clock;
  OdometerOptions state;  ///< always of odometry
  RadioFrom radio_from = RadioFrom::kInputRc;
  RadioSwitches radio;
  /// False: the person's radio arms and nobody else; the bridge asks for the mode when that is done.
  bool arm_by_command = false;
  flight::ThrustOptions thrust;
  QuadrotorModel quadrotor;
  Stamp connect_timeout{std::chrono::seconds(10)};  ///< until PX4 is heard; 100 ms to 10 min
};

/// Says which field is wrong and why.
Status validate(const Px4Config& config);

}  // namespace gatefield::bridge
