#pragma once

#include <string>
#include <vector>

#include "common/dds/network.h"

namespace gatefield::dds {

/// What Fast DDS would take from the environment by itself, half of it, is taken out of it: files of XML profiles and
/// of further variables, statistics. ROS_DISCOVERY_SERVER stays, and is honoured (resolve()).
/// A file that asks for security is left for check_environment() to find.
/// For the main function of a program, before it has threads; libraries leave a process's environment alone.
/// @return for people, a sentence for each variable or file that was found: what comes of it
std::vector<std::string> settle_environment(const NetworkOptions& options);

/// Whoever asks for security in a file of XML profiles must not fly unprotected because nobody reads it. For any
/// program and library user: looks at the variables and files above that Fast DDS would read.
/// Errors: kInvalid with the field "security", where such a file holds a property dds.sec. and options.security is
/// empty.
/// Thread-safe: as std::getenv.
Status check_environment(const NetworkOptions& options);

}  // namespace gatefield::dds
