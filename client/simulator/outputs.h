#pragma once

#include "client/simulator/arguments.h"
#include "client/simulator/run_log.h"

/// The files that gatefield-sim leaves of a race. Errors: the sentence names the file.
namespace gatefield::simulator {

/// A file that can't be written is better known before the race than after it. Makes their folders.
Status check_outputs(const Arguments& arguments);

/// Writes those that were asked for.
Status write_outputs(const Arguments& arguments, const config::Scenario& scenario, const Report& report);

}  // namespace gatefield::simulator
