#include "common/model/two_look.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>

namespace gatefield::model {
namespace {

/// Nearest pixel column or row along a ray's x or y (z = 1), or -1 outside the image.
int column_along(const CameraModel& camera, double ray_x) noexcept {
  const double u = camera.fx_px * ray_x + camera.cx_px;
  return u >= 0.0 && u < camera.width_px ? static_cast<int>(u) : -1;
}
int row_along(const CameraModel& camera, double ray_y) noexcept {
  const double v = camera.fy_px * ray_y + camera.cy_px;
  return v >= 0.0 && v < camera.height_px ? static_cast<int>(v) : -1;
}

/// Nearest pixel index for a ray, or -1 outside the image.
int pixel_along(const CameraModel& camera, double ray_x, double ray_y) noexcept {
  const int u = column_along(camera, ray_x);
  const int v = row_along(camera, ray_y);
  return u < 0 || v < 0 ? -1 : v * camera.width_px + u;
}

}  // namespace

LookShape look_shape(int width_px, int height_px) noexcept {
  assert(width_px % 16 == 0 && height_px % 2 == 0);
  return {width_px / 2, (height_px / 2 + 7) / 8 * 8};
}

void first_look_input(std::span<const float> depth_m, const CameraModel& camera, std::span<float> input,
                      std::span<float> anchors) noexcept {
  const LookShape shape = look_shape(camera.width_px, camera.height_px);
  const auto plane = static_cast<std::size_t>(shape.width) * shape.height;
  const auto anchor_plane = static_cast<std::size_t>(shape.anchor_width()) * shape.anchor_height();
  assert(depth_m.size() == static_cast<std::size_t>(camera.width_px) * camera.height_px);
  assert(input.size() == shape.input_size() && anchors.size() == shape.anchor_size());
  std::fill(input.begin(), input.end(), 0.0f);
  std::fill(anchors.begin(), anchors.end(), 0.0f);

  const auto fx = static_cast<float>(1.0 / camera.fx_px);
  const auto fy = static_cast<float>(1.0 / camera.fy_px);
  const auto cx = static_cast<float>(camera.cx_px);
  const auto cy = static_cast<float>(camera.cy_px);
  const int rows = camera.height_px / 2;
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < shape.width; ++column) {
      const auto at = static_cast<std::size_t>(row) * shape.width + column;
      float mean[3] = {0.0f, 0.0f, 0.0f};
      int count = 0;
      for (int sub = 0; sub < 4; ++sub) {
        const int u = 2 * column + (sub & 1);
        const int v = 2 * row + (sub >> 1);
        const float z = depth_m[static_cast<std::size_t>(v) * camera.width_px + u];
        if (!(z > 0.0f)) continue;
        input[static_cast<std::size_t>(sub) * plane + at] = 1.0f / z;
        input[static_cast<std::size_t>(4 + sub) * plane + at] = 1.0f;
        const float x = (static_cast<float>(u) + 0.5f - cx) * fx * z;
        const float y = (static_cast<float>(v) + 0.5f - cy) * fy * z;
        mean[0] += x;
        mean[1] += y;
        mean[2] += z;
        ++count;

        const auto anchor_at = static_cast<std::size_t>(row / 2) * shape.anchor_width() + column / 2;
        float& nearest = anchors[2 * anchor_plane + anchor_at];
        float& seen = anchors[3 * anchor_plane + anchor_at];
        if (seen == 0.0f || z < nearest) {
          anchors[anchor_at] = x;
          anchors[anchor_plane + anchor_at] = y;
          nearest = z;
          seen = 1.0f;
        }
      }
      const float scale = count > 0 ? 1.0f / (kLookScale_m * static_cast<float>(count)) : 0.0f;
      for (std::size_t axis = 0; axis < 3; ++axis) input[(8 + axis) * plane + at] = mean[axis] * scale;
      input[11 * plane + at] = (2.0f * static_cast<float>(column) + 1.0f - cx) * fx;
      input[12 * plane + at] = (2.0f * static_cast<float>(row) + 1.0f - cy) * fy;
    }
  }
}

Eigen::Vector3d crop_ray_C(const CropShape& shape, const Eigen::Vector3d& center_C, int i, int j) noexcept {
  const double half = shape.half_width_m / center_C.z();
  return {center_C.x() / center_C.z() + (2.0 * (i + 0.5) / shape.size - 1.0) * half,
          center_C.y() / center_C.z() + (2.0 * (j + 0.5) / shape.size - 1.0) * half, 1.0};
}

int crop_input(std::span<const float> depth_m, const CameraModel& camera, const CropShape& shape,
               const Eigen::Vector3d& center_C, std::span<float> input, std::span<float> context) noexcept {
  assert(center_C.z() >= kCropMinDepth_m && shape.size <= kMaxCropSize);
  assert(input.size() == shape.input_size() && context.size() == static_cast<std::size_t>(kCropContext));
  const auto plane = static_cast<std::size_t>(shape.size) * shape.size;
  const Eigen::Vector3f center = center_C.cast<float>();
  std::fill(input.begin(), input.end(), 0.0f);
  float* const dx = input.data();
  float* const dy = dx + plane;
  float* const dz = dy + plane;
  float* const seen = dz + plane;
  float* const nearer = seen + plane;
  float* const behind = nearer + plane;
  float* const inside = behind + plane;
  // Columns are the same for every row.
  struct Column {
    int u;
    float ray_x;
  };
  std::array<Column, kMaxCropSize> columns;
  for (int i = 0; i < shape.size; ++i) {
    const int u = column_along(camera, crop_ray_C(shape, center_C, i, 0).x());
    columns[static_cast<std::size_t>(i)] = {u, static_cast<float>((u + 0.5 - camera.cx_px) / camera.fx_px)};
  }
  int returns = 0;
  for (int j = 0; j < shape.size; ++j) {
    const int v = row_along(camera, crop_ray_C(shape, center_C, 0, j).y());
    if (v < 0) continue;
    const auto ray_y = static_cast<float>((v + 0.5 - camera.cy_px) / camera.fy_px);
    const float* const row = depth_m.data() + static_cast<std::size_t>(v) * camera.width_px;
    for (int i = 0; i < shape.size; ++i) {
      const auto [u, ray_x] = columns[static_cast<std::size_t>(i)];
      if (u < 0) continue;
      const auto at = static_cast<std::size_t>(j) * shape.size + i;
      inside[at] = 1.0f;
      const float z = row[u];
      if (!(z > 0.0f)) continue;
      ++returns;
      // The pixel's own ray, not the sample's: far gates are sampled more finely than the image is.
      const float offset_z = z - center.z();
      dx[at] = std::clamp(z * ray_x - center.x(), -kCropReach_m, kCropReach_m);
      dy[at] = std::clamp(z * ray_y - center.y(), -kCropReach_m, kCropReach_m);
      dz[at] = std::clamp(offset_z, -kCropReach_m, kCropReach_m);
      seen[at] = 1.0f;
      if (offset_z < -kCropReach_m) nearer[at] = 1.0f;
      if (offset_z > kCropReach_m) behind[at] = 1.0f;
    }
  }
  context[0] = center.x() / center.z();
  context[1] = center.y() / center.z();
  context[2] = 1.0f / center.z();
  return returns;
}

void crop_depth(std::span<const float> depth_m, const CameraModel& camera, const CropShape& shape,
                const Eigen::Vector3d& center_C, int stride, std::span<float> relative_m,
                std::span<float> weight) noexcept {
  assert(center_C.z() >= kCropMinDepth_m && stride > 0);
  const int size = shape.size / stride;
  for (int j = 0; j < size; ++j) {
    for (int i = 0; i < size; ++i) {
      const auto at = static_cast<std::size_t>(j) * size + i;
      const Eigen::Vector3d ray = crop_ray_C(shape, center_C, i * stride + stride / 2, j * stride + stride / 2);
      const int pixel = pixel_along(camera, ray.x(), ray.y());
      const float z = pixel < 0 ? 0.0f : depth_m[static_cast<std::size_t>(pixel)];
      weight[at] = z > 0.0f ? 1.0f : 0.0f;
      relative_m[at] = z > 0.0f ? std::clamp(z - static_cast<float>(center_C.z()), -kCropReach_m, kCropReach_m) : 0.0f;
    }
  }
}

void plain_input(std::span<const float> depth_m, std::span<float> input) noexcept {
  const std::size_t size = depth_m.size();
  for (std::size_t i = 0; i < size; ++i) {
    const bool seen = depth_m[i] > 0.0f;
    input[i] = seen ? 1.0f / depth_m[i] : 0.0f;
    input[size + i] = seen ? 1.0f : 0.0f;
  }
}

void resample_nearest(std::span<const float> depth_m, const CameraModel& from, const CameraModel& to,
                      std::vector<float>* out) {
  assert(depth_m.size() == static_cast<std::size_t>(from.width_px) * from.height_px);
  out->assign(static_cast<std::size_t>(to.width_px) * to.height_px, 0.0f);
  for (int v = 0; v < to.height_px; ++v) {
    for (int u = 0; u < to.width_px; ++u) {
      const Eigen::Vector3d ray = to.ray_C(u, v);
      const int pixel = pixel_along(from, ray.x(), ray.y());
      if (pixel < 0) continue;
      const float z = depth_m[static_cast<std::size_t>(pixel)];
      if (z >= static_cast<float>(to.min_depth_m) && z <= static_cast<float>(to.max_depth_m)) {
        (*out)[static_cast<std::size_t>(v) * to.width_px + u] = z;
      }
    }
  }
}

}  // namespace gatefield::model
