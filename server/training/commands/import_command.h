#pragma once

#include <CLI/App.hpp>

namespace gatefield::training {

/// gatefield-train import: recordings of a real camera into a data set.
void add_import_command(CLI::App* app, int* exit_code);

}  // namespace gatefield::training
