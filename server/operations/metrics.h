#pragma once

#include <cstdint>
#include <string>

#include "server/operations/health.h"
#include "server/operations/process_figures.h"
#include "server/service/figures.h"

namespace gatefield::operations {

/// What stays the same while a server runs.
struct ServerWords {
  std::string version, name, isa;
  std::uint64_t model_hash = 0;
  std::uint32_t domain = 0;
};

/// All that there is to know, as Prometheus reads it (text format 0.0.4): names begin with gatefield_, those of the
/// process with process_ as its own client libraries have them. Totals count from the server's start and only grow;
/// what has a label `vehicle` is of those that have a session now.
/// @param packets_dropped  from the network, that were not shown to the middleware
/// Thread-safe: yes.
std::string metrics(const ServerWords& words, const service::Figures& figures, const Health& health,
                    const ProcessFigures& process, std::uint64_t packets_dropped);

}  // namespace gatefield::operations
