#pragma once

#include <array>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <vector>

#include "common/base/result.h"
#include "server/training/data/recording.h"

/// Plain frames of a real depth camera, without poses and without gates.
namespace gatefield::training {

/// Where they lie: a folder of images, 16-bit grey PNG or `.raw` (width x height little-endian 16-bit numbers, row by
/// row), z-depth, 0 = no return. The camera's numbers are told by the folder's camera.txt (import.h), by another such
/// file, or as options.
struct FrameFolder {
  std::filesystem::path folder;
  std::filesystem::path camera_file = {};  ///< empty: camera.txt of the folder
  /// fx fy cx cy in pixels of the images, the first pixel's centre at 0.5; in place of a file. Sizes come from the
  /// first PNG then, millimetres are taken for granted.
  std::optional<std::array<double, 4>> intrinsics_px = std::nullopt;
};

struct DepthFrames {
  std::filesystem::path folder;
  RecordedCamera camera;
  std::vector<std::filesystem::path> images;  ///< in order of their names
};

/// Errors: no folder, no images in it, no or a wrong camera file, raw images without one.
Result<DepthFrames> find_frames(const FrameFolder& where);

/// z-depth in metres, row-major; whatever the camera's range, 0 = no return.
/// Errors: no image of 16 bits, another size than the camera's.
Result<std::vector<float>> read_frame(const DepthFrames& frames, std::size_t index);

}  // namespace gatefield::training
