#include "server/training/commands/frame_options.h"

#include <CLI/CLI.hpp>
#include <algorithm>

namespace gatefield::training {

FrameFolder FrameOptions::folder(const std::filesystem::path& where) const {
  FrameFolder out{where, camera_file};
  if (intrinsics_px.size() == 4) {
    out.intrinsics_px.emplace();
    std::ranges::copy(intrinsics_px, out.intrinsics_px->begin());
  }
  return out;
}

void add_frame_options(CLI::App* command, FrameOptions* options) {
  auto* const file = command->add_option("--camera", options->camera_file,
                                         "of plain frames: a camera.txt (docs/datasets.md); not given: the folder's");
  command
      ->add_option(
          "--intrinsics", options->intrinsics_px,
          "of plain frames: fx fy cx cy in pixels of the images (first pixel's centre at 0.5), in place of a file")
      ->expected(4)
      ->excludes(file);
}

}  // namespace gatefield::training
