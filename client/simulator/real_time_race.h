#pragma once

#include "client/simulator/race_parts.h"

namespace gatefield::simulator {

/// Flies the race by the monotonic clock, see fly(). Fills the report's ticks, frames and deadlines.
void run_real_time(const RaceParts& race, Report* report);

}  // namespace gatefield::simulator
