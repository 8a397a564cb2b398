#pragma once

#include <CLI/App.hpp>

namespace gatefield::training {

void add_fit_noise_command(CLI::App* app, int* exit_code);

}  // namespace gatefield::training
