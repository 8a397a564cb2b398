#pragma once

#include <filesystem>
#include <string>

#include "client/simulator/run_log.h"

namespace gatefield::simulator {

/// The depth frame in colours, near to far, with a colour bar; pixels without a return are black.
/// Errors: the file can't be written (its name and why).
Status write_depth_picture(const std::filesystem::path& file, const Snapshot& snapshot, const std::string& title);

/// Keeps the frame for other programs: <folder>/depth.png, 16 bits per pixel in millimetres, and <folder>/frame.txt,
/// where from (schema: common/config/frame.proto), with the true gate ahead to compare with.
Status save_frame(const std::filesystem::path& folder, const Snapshot& snapshot);

}  // namespace gatefield::simulator
