#pragma once

#include <filesystem>
#include <memory>

#include "common/base/result.h"
#include "common/protocol/messages.h"
#include "server/planner/planner.h"

namespace gatefield::app {

struct TraceOptions {
  std::filesystem::path folder;  ///< empty: no trace
  bool rollouts = false;         ///< and about 64 rollouts of every fifth step
};

/// The planner, with everything that it is asked written to <folder>/<vehicle>.trace (common/trace/trace.h), step by
/// step, before its answer. For evaluation in lockstep: the control step then writes to the disk.
/// Errors: the planner's own; a file that can't be written.
Result<std::unique_ptr<planner::Planner>> traced(Result<std::unique_ptr<planner::Planner>> planner,
                                                 const protocol::SessionRequest& request, const TraceOptions& options);

}  // namespace gatefield::app
