#pragma once

#include "client/simulator/race_parts.h"

namespace gatefield::simulator {

/// Flies the race in simulated time, see fly(). Fills the report's ticks and frames.
void run_lockstep(const RaceParts& race, Report* report);

}  // namespace gatefield::simulator
