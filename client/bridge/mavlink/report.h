#pragma once

#include <string>
#include <vector>

#include "client/bridge/mavlink/autopilot.h"
#include "client/firmware/mavlink/frame_reader.h"

namespace gatefield::bridge {

/// What was found, a line each: who it is, how far away, its clock, the parameters that matter.
std::vector<std::string> description(const AutopilotReport& report, const MavlinkConfig& config);

/// What stands in the way of a flight, a sentence each with the next step; empty: nothing that is known of.
std::vector<std::string> complaints(const AutopilotReport& report, const mavlink::ReaderCounts& counts,
                                    const MavlinkConfig& config);

}  // namespace gatefield::bridge
