#pragma once

#include <CLI/App.hpp>
#include <filesystem>

#include "server/training/commands/frame_options.h"
#include "server/training/evaluation/no_gate.h"

namespace gatefield::training {

/// `evaluate --no-gate FOLDER`: what it asks for beside evaluate's own options.
struct NoGateArguments {
  std::filesystem::path frames, noise_file;
  FrameOptions camera;
  NoGateOptions options;
};
void add_no_gate_options(CLI::App* command, NoGateArguments* arguments);

/// Prints the tables, and writes them with their CSVs when `out` is not empty. @return exit code
int run_no_gate(NoGateArguments arguments, const Named& bundle, int threads, std::uint64_t seed,
                const std::filesystem::path& out);

}  // namespace gatefield::training
