#pragma once

#include <atomic>

#include "client/race/options.h"

namespace gatefield::race {

/// The subcommand tune, told on the terminal. @return the exit code
int tune(const Arguments& arguments, const std::atomic<bool>& stop);

}  // namespace gatefield::race
