#pragma once

#include <CLI/App.hpp>
#include <filesystem>

#include "server/training/evaluation/evaluate.h"

namespace gatefield::training {

void add_evaluate_command(CLI::App* app, int* exit_code);

/// Evaluates with progress on the terminal, prints the table and writes it into `out` (unless empty).
/// @return 0, kBadInput or kStopped
int run_evaluation(const EvaluateOptions& options, const std::filesystem::path& out);

}  // namespace gatefield::training
