#pragma once

#include <string>
#include <vector>

#include "common/dds/network.h"

namespace gatefield::dds {

/// What Fast DDS would take from the environment by itself, half of it, is taken out of it: files of XML profiles and
/// of further variables, statistics. ROS_DISCOVERY_SERVER stays, and is honoured (resolve()).
/// For the main function of a program, before it has threads; libraries leave a process's environment alone.
/// @return for people, a sentence for each variable or file that was found: what comes of it
std::vector<std::string> settle_environment(const NetworkOptions& options);

}  // namespace gatefield::dds
