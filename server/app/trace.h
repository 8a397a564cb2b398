#pragma once

#include <filesystem>
#include <memory>

#include "common/base/result.h"
#include "common/protocol/messages.h"
#include "server/pilot/step_observer.h"
#include "server/planner/profile.h"

namespace gatefield::app {

struct TraceOptions {
  std::filesystem::path folder;  ///< empty: no trace
  bool rollouts = false;         ///< and about 64 rollouts of every fifth step
};

/// Writes what is believed and planned at each step to <folder>/<vehicle>.trace (common/trace/trace.h), before the
/// step's answer. For evaluation in lockstep: the control step then writes to the disk.
/// When a step can't be written in the middle (the disk is full), the log says so once and the file ends there.
/// Errors (kUnreadable): a file that can't be opened for writing.
Result<std::unique_ptr<pilot::StepObserver>> make_tracer(const protocol::SessionRequest& request,
                                                         const planner::Profile& profile, const TraceOptions& options);

}  // namespace gatefield::app
