#pragma once

#include <string>

#include "common/base/clock.h"
#include "common/base/result.h"

namespace gatefield::firmware {

/// Where a firmware takes its sensors from a simulator, and how long it is waited for. The address says whose clock it
/// is: PX4's SITL over TCP runs in lockstep (HilLink), a board on a serial port by its own clock (HilBoard).
struct HilOptions {
  /// parse_address(): tcp-listen:HOST:PORT, where PX4's SITL connects to; serial:DEVICE:BAUD, a board
  std::string address = "tcp-listen:127.0.0.1:4560";
  Stamp connect_timeout{std::chrono::seconds(30)};      ///< until it connects, a board speaks; 100 ms to 10 min
  Stamp boot_timeout{std::chrono::seconds(60)};         ///< lockstep: then to its first motor outputs; 1 s to 10 min
  Stamp answer_timeout{std::chrono::seconds(1)};        ///< lockstep: for each answer after that; 10 ms to 60 s
  Stamp silence_limit{std::chrono::milliseconds(500)};  ///< a board's motors, once it is armed; 50 ms to 5 s
  double sample_rate_hz = 250.0;  ///< a board's samples, 20 to 1000 Hz, as far as its line has room; lockstep: 250
};
/// Says which field is wrong and why.
Status validate(const HilOptions& options);

/// A board by its own clock, and not lockstep. @pre validate(options)
bool is_board(const HilOptions& options);

/// Whether the samples find room on a board's line, at four fifths of its baud rate, with the other messages there.
/// @param setpoint_rate_hz  of SET_ATTITUDE_TARGET on the same line; 0: none
/// @pre is_board(options)
/// Errors: kInvalid with field "sample_rate_hz" and the rate that fits; "address.baud" where none does.
Status check_room(const HilOptions& options, double setpoint_rate_hz);

}  // namespace gatefield::firmware
