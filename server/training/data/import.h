#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/geometry/camera.h"
#include "server/training/data/dataset.h"

/// Recordings of a real depth camera, turned into a data set of kind 'recording' (docs/datasets.md).
namespace gatefield::training {

/// One recording is a folder:
///   camera.txt  lines `name value`: width_px height_px fx_px fy_px cx_px cy_px, and if they differ from what is given
///               here: min_depth_m 0.3, max_depth_m 10, depth_unit_m 0.001 (metres per grey level), pixel_center 0.5
///               (where a pixel's centre lies; 0 for intrinsics as OpenCV, ROS and RealSense give them)
///   poses.csv   columns file,time_s,p_WC_x,p_WC_y,p_WC_z,q_WC_w,q_WC_x,q_WC_y,q_WC_z: one line a frame; file is a
///               16-bit grey PNG, z-depth, 0 = no return; camera frame C: x right, y down, z forward
///   gates.csv   columns p_WG_x,p_WG_y,p_WG_z,q_WG_w,q_WG_x,q_WG_y,q_WG_z,inner_half_m,outer_half_m,thickness_m, and
///               opening (square or round) if wanted: one line a gate; gate frame G: x through the opening, z up
/// The first line of a CSV names its columns, in any order; others are left aside. '#' begins a comment in camera.txt.
struct ImportOptions {
  std::vector<std::filesystem::path> recordings;  ///< each becomes one sequence: 0, 1, ...
  std::string note = {};
};

struct ImportSummary {
  std::uint64_t frames = 0;
  std::uint64_t with_valid_gate = 0;
  double returns = 0.0;  ///< mean part of the pixels with a return, after resampling
};

/// Reads the folders, resamples every image to the data sets' camera (nearest pixel along each ray) and writes `file`,
/// with X_WC, sequence and time. Labels: each gate's pose in the camera's frame; the four that are seen best where
/// there are more. `progress(done, total)` returns false to stop (the file is removed). Errors: file exists already; a
/// folder's file missing or unreadable; a line with too few values, no number, a time not after the line before's, a
/// quaternion of another norm than 1; an image that is no 16-bit grey PNG or of another size than camera.txt's: each
/// names file, line, value and what was expected.
Result<ImportSummary> import_recordings(const std::filesystem::path& file, const ImportOptions& options,
                                        const std::function<bool(std::uint64_t, std::uint64_t)>& progress = {});

}  // namespace gatefield::training
