#pragma once

#include <optional>

#include "client/firmware/link/link.h"
#include "client/flight/thrust_estimate.h"
#include "common/base/result.h"

namespace gatefield::bridge::betaflight {

/// A switch among the radio's channels, as the firmware sees it: it is on while the pulse lies between the two.
struct Switch {
  int aux = 1;  ///< AUX1 is 1; to 14
  int from_us = 1700, to_us = 2100;
};

/// How to speak to a flight controller with Betaflight.
struct Options {
  firmware::Address link;

  /// Who is the receiver.
  enum class Receiver {
    kBridge,    ///< feature RX_MSP: the bridge is; nobody else can fly. The firmware's failsafe follows when it stops.
    kOverride,  ///< a person's radio, whose mode MSP OVERRIDE gives the sticks to the bridge and takes them back
    kUdp,       ///< the bridge is, over a port of the target SITL (BetaflightVehicle::send_through()), from 4.5 on
  };
  Receiver receiver = Receiver::kBridge;

  double channels_hz = 100.0;  ///< how often the sticks are sent, 50 to 500
  int arm_aux = 1;             ///< AUX channel of the mode ARM, 1 to 14
  int arm_us = 1900;           ///< the pulse that arms, 1000 to 2000; the one that does not is 1000
  bool yaw_reversed = false;   ///< the firmware's yaw_control_reversed
  std::optional<Switch> kill;  ///< kOverride: a person's kill switch

  flight::ThrustOptions thrust;
};

/// Says which field is wrong and why.
Status validate(const Options& options);

}  // namespace gatefield::bridge::betaflight
