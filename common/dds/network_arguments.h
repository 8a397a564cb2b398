#pragma once

#include <string>
#include <vector>

#include "common/dds/network.h"

namespace CLI {
class App;
}

/// NetworkOptions on a command line, the same in every program that joins a DDS domain.
namespace gatefield::dds {

/// Adds --peer, --interface, --discovery-server, --shared-memory and --security; what is wrong in itself is refused by
/// the parser.
/// @param group  heading in --help   @param options  outlives the parsing
void add_network_options(CLI::App* app, NetworkOptions* options, const std::string& group = "Network");

/// The same as words of a command line, for a program that starts another one; without security, where each has
/// a folder of its own.
std::vector<std::string> network_arguments(const NetworkOptions& options);

}  // namespace gatefield::dds
