#pragma once

#include <CLI/App.hpp>

namespace gatefield::training {

void add_figures_command(CLI::App* app, int* exit_code);

}  // namespace gatefield::training
