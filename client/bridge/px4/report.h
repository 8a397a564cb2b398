#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "client/bridge/px4/autopilot.h"

namespace gatefield::bridge {

/// What the bus itself says, beside what came through it.
struct BusReport {
  std::vector<std::string> offered;  ///< topics of a PX4 that somebody writes (px4::Endpoint::offered())
  std::uint64_t rejected = 0;        ///< messages that were not taken
  std::optional<Error> why;          ///< of the newest of them
  std::uint64_t not_sent = 0;        ///< messages that the middleware did not take
};

/// What was found, a line each: who it is, its release, its clock.
std::vector<std::string> description(const Px4Report& report, const Px4Config& config);

/// What stands in the way of a flight, a sentence each with the next step; empty: nothing that is known of.
std::vector<std::string> complaints(const Px4Report& report, const BusReport& bus, const Px4Config& config);

}  // namespace gatefield::bridge
