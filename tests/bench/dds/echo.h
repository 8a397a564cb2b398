#pragma once

#include "tests/bench/dds/wire.h"

namespace gatefield::bench {

/// The other process of the measurement of the wire alone: answers each state with a plan of 20 steps, from a thread of
/// its own as the planner does, and writes to stdout how long each depth frame was under way, in seconds, a line each.
/// @return exit code, when nothing came for a second after something had
int echo(const Wire& wire);

}  // namespace gatefield::bench
