#include "server/training/data/depth_frames.h"

#include <algorithm>
#include <cstdint>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <system_error>

#include "common/base/whole_file.h"

namespace gatefield::training {
namespace {

namespace fs = std::filesystem;

bool is_raw(const fs::path& file) { return file.extension() == ".raw"; }

Result<RecordedCamera> camera_of(const FrameFolder& where, const std::vector<fs::path>& images) {
  if (!where.intrinsics_px) {
    const fs::path file = where.camera_file.empty() ? where.folder / "camera.txt" : where.camera_file;
    if (!fs::is_regular_file(file)) {
      return Error{"the camera of " + where.folder.string() + " is not told: " + file.string() +
                       " is not there. Write one (width_px, height_px, fx_px, fy_px, cx_px, cy_px), name another one "
                       "with --camera, or give --intrinsics fx fy cx cy",
                   ErrorCode::kUnreadable};
    }
    return read_camera(file);
  }
  if (is_raw(images.front()))
    return Error::invalid("intrinsics", "four numbers", "a camera file: raw images don't tell their size");
  const cv::Mat first = cv::imread(images.front().string(), cv::IMREAD_UNCHANGED);
  if (first.empty()) return Error{images.front().string() + " can't be read, expected a PNG", ErrorCode::kUnreadable};
  RecordedCamera camera;
  camera.model.width_px = first.cols;
  camera.model.height_px = first.rows;
  const auto& [fx, fy, cx, cy] = *where.intrinsics_px;
  camera.model.fx_px = fx;
  camera.model.fy_px = fy;
  camera.model.cx_px = cx;
  camera.model.cy_px = cy;
  if (const Status valid = validate(camera.model); !valid) return valid.failure().within("--intrinsics: ");
  return camera;
}

Result<std::vector<float>> read_raw(const fs::path& file, const RecordedCamera& camera) {
  const auto content = read_file(file);
  if (!content) return content.failure();
  const std::size_t pixels = static_cast<std::size_t>(camera.model.width_px) * camera.model.height_px;
  if (content->size() != 2 * pixels) {
    return Error{file.string() + " has " + std::to_string(content->size()) + " bytes, expected " +
                     std::to_string(2 * pixels) + ": " + std::to_string(camera.model.width_px) + " x " +
                     std::to_string(camera.model.height_px) + " numbers of 16 bits",
                 ErrorCode::kUnreadable};
  }
  std::vector<float> depth_m(pixels);
  for (std::size_t i = 0; i < pixels; ++i) {
    const auto low = static_cast<unsigned char>((*content)[2 * i]);
    const auto high = static_cast<unsigned char>((*content)[2 * i + 1]);
    depth_m[i] = static_cast<float>(camera.unit_m) * static_cast<float>(low | high << 8);
  }
  return depth_m;
}

}  // namespace

Result<DepthFrames> find_frames(const FrameFolder& where) {
  std::error_code code;
  DepthFrames frames;
  frames.folder = where.folder;
  for (const auto& entry : fs::directory_iterator(where.folder, code)) {
    const fs::path& file = entry.path();
    if (file.extension() == ".png" || is_raw(file)) frames.images.push_back(file);
  }
  if (code)
    return Error{"folder " + where.folder.string() + " can't be read: " + code.message(), ErrorCode::kUnreadable};
  if (frames.images.empty()) {
    return Error{"folder " + where.folder.string() + " has no frames, expected depth images *.png (16 bits) or *.raw",
                 ErrorCode::kUnreadable};
  }
  std::ranges::sort(frames.images);
  const auto camera = camera_of(where, frames.images);
  if (!camera) return camera.failure();
  frames.camera = *camera;
  return frames;
}

Result<std::vector<float>> read_frame(const DepthFrames& frames, std::size_t index) {
  const fs::path& file = frames.images[index];
  return is_raw(file) ? read_raw(file, frames.camera) : read_depth_png(file, frames.camera);
}

}  // namespace gatefield::training
