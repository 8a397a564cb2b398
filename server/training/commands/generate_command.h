#pragma once

#include <CLI/App.hpp>
#include <cstdint>
#include <filesystem>

namespace gatefield::training {

void add_generate_command(CLI::App* app, int* exit_code);

/// Renders (or continues) a simulated set with progress on the terminal. @param points stored with each image
/// @param round_part of the gates have round openings
/// @return 0, kBadInput or kStopped
int generate_file(const std::filesystem::path& file, std::uint64_t seed, std::uint64_t count, int threads,
                  int points = 0, double round_part = 0.0);

}  // namespace gatefield::training
