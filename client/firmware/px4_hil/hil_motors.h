#pragma once

#include <array>
#include <cstdint>

#include "client/firmware/mavlink/messages_hil.h"
#include "common/base/result.h"

namespace gatefield::firmware {

/// What the firmware tells the motors.
struct HilMotors {
  static constexpr std::size_t kMotors = 4;
  std::array<double, kMotors> outputs{};  ///< 0 to 1, of the first four in the firmware's order; 0: off
  bool armed = false;
  std::uint64_t answers = 0;  ///< messages since the begin

  /// Takes up a message.
  /// Errors: kInvalid for outputs that are no numbers or out of range, with their names there.
  Status take(const mavlink::HilActuatorControls& controls);
};

}  // namespace gatefield::firmware
