#pragma once

#include <cstdint>
#include <span>

#include "client/flight/ports.h"
#include "common/base/result.h"

namespace gatefield::bridge {

/// Which channels of the person's radio are switches, from 1; 0: there is none. A switch is on from `threshold_us` up.
struct RadioSwitches {
  int arm = 0;
  int take_over = 0;
  int kill = 0;
  int threshold_us = 1600;  ///< 1100 to 1900
};

/// Says which field is wrong and why. @param channels  that the radio may have
Status validate(const RadioSwitches& radio, int channels);

/// The switches as the radio's channels say, us; a channel that is not there, or 65535, is off.
/// Thread-safe: yes.   Real-time safe: yes.
flight::PilotSwitches switches(const RadioSwitches& radio, std::span<const std::uint16_t> channels_us) noexcept;

}  // namespace gatefield::bridge
