#pragma once

#include <CLI/App.hpp>
#include <cstdint>
#include <filesystem>

namespace gatefield::training {

void add_stereo_command(CLI::App* app, int* exit_code);

/// Renders (or continues) flights seen by the second sensor, with progress on the terminal.
/// @return 0, kBadInput or kStopped
int stereo_file(const std::filesystem::path& file, std::uint64_t seed, std::uint64_t count, int threads,
                std::uint64_t rooms = 25);

}  // namespace gatefield::training
