#pragma once

#include <CLI/App.hpp>

namespace gatefield::training {

/// Trains several designs with several seeds for the same number of image passes and holds them side by side.
void add_compare_command(CLI::App* app, int* exit_code);

}  // namespace gatefield::training
