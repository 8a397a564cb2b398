#pragma once

#include <string>
#include <variant>

#include "client/firmware/px4_hil/hil_options.h"
#include "client/firmware/px4_hil/sensors.h"
#include "common/base/clock.h"
#include "common/base/result.h"
#include "common/dds/px4/layout.h"

namespace gatefield::simulator {

/// Setpoints go over MAVLink on the port that the board takes its sensors from.
struct SameLink {};

/// Where PX4 is, what it is shown, and how setpoints get to it.
struct Px4Options {
  firmware::HilOptions hil;         ///< where its sensors come from: its SITL, in lockstep, or a board in real time
  firmware::SensorOptions sensors;  ///< their errors; the seed is the scenario's
  /// How setpoints get to it: on the bus, through its uXRCE-DDS agent; over MAVLink, a link of parse_address(); or, to
  /// a board, beside its sensors.
  std::variant<px4::BusOptions, std::string, SameLink> setpoints = px4::BusOptions();
  /// THR_MDL_FAC as it is set there, 0 to 1: rotors here give T = T_max o^2, so 1 makes thrust of its setpoints linear.
  double thrust_model_factor = 1.0;
  /// Lockstep: simulated time against the machine's at most, 0.01 to 20: setpoints go to PX4 over links of the real
  /// world, and how old they are there in simulated time grows with it. 1 with a board.
  double pace = 1.0;
  /// Of PX4's time, from when it is connected until it hovers; 1 to 300 s.
  Stamp arm_limit = std::chrono::seconds(60);
};
/// Says which field is wrong and why.
Status validate(const Px4Options& options);

/// Setpoints a second, to PX4 whichever way they go.
inline constexpr double kPx4Setpoints_hz = 250.0;

}  // namespace gatefield::simulator
