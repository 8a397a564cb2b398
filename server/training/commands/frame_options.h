#pragma once

#include <CLI/App.hpp>
#include <memory>
#include <vector>

#include "server/training/data/depth_frames.h"

namespace gatefield::training {

/// What commands that read plain frames ask for.
struct FrameOptions {
  std::filesystem::path camera_file;
  std::vector<double> intrinsics_px;

  FrameFolder folder(const std::filesystem::path& folder) const;
};
/// Declares --camera and --intrinsics.
void add_frame_options(CLI::App* command, FrameOptions* options);

}  // namespace gatefield::training
