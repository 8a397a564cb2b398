#pragma once

#include <CLI/App.hpp>
#include <filesystem>
#include <string>

#include "server/training/learn/train_loop.h"

namespace gatefield::training {

void add_train_command(CLI::App* app, int* exit_code);
void add_export_command(CLI::App* app, int* exit_code);
void add_designs_command(CLI::App* app, int* exit_code);

/// Declares what every command that trains understands: batch, threads, single precision ...
void add_training_options(CLI::App* command, TrainRun* run);

/// Trains to the end of the plan and draws the learning curves. @return 0, kBadInput or kStopped
int run_training(const TrainRun& run);

/// Writes a bundle from a checkpoint, with its learning curve (training.csv) beside it.
/// @return 0 or kBadInput
int export_checkpoint(const std::filesystem::path& checkpoint, const std::string& name,
                      const std::filesystem::path& out);

}  // namespace gatefield::training
