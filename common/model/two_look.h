#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "common/geometry/camera.h"

/// What the encoders' networks see (docs/training.md): pure geometry, shared by training and server so that both see
/// the same.
///
/// First look: the whole image at half resolution. Second look: a square crop around a given centre, in metres around
/// that centre. All tensors are row-major [channel][row][column]. Depth images are row-major z-depth in metres, 0 = no
/// return. Thread-safe: yes (pure).   Real-time safe: yes (no allocation), except resample_nearest when its output
/// grows.
namespace gatefield::model {

inline constexpr int kLookChannels = 13;   ///< 4 inverse depths, 4 validity masks, mean X Y Z, ray x y
inline constexpr int kAnchorChannels = 4;  ///< X Y Z of the nearest return in a 4 x 4 block, validity
/// dX dY dZ, has a return, nearer than the window, behind it, inside the image
inline constexpr int kCropChannels = 7;
inline constexpr int kCropContext = 3;  ///< centre's direction x/z, y/z and 1/z

/// Distances are divided by this before they enter the first look, so that inputs are of order one.
inline constexpr float kLookScale_m = 5.0f;
/// Crop coordinates are clamped to this; what lies beyond in z is marked 'nearer' or 'behind'.
inline constexpr float kCropReach_m = 2.0f;
/// A centre nearer than this can't be cropped around.
inline constexpr double kCropMinDepth_m = 0.3;

/// Sizes of the first look for a camera: half resolution, the height filled up to a multiple of eight rows by empty
/// ones.
struct LookShape {
  int width = 0;
  int height = 0;
  int anchor_width() const noexcept { return width / 2; }
  int anchor_height() const noexcept { return height / 2; }
  std::size_t input_size() const noexcept { return static_cast<std::size_t>(kLookChannels) * width * height; }
  std::size_t anchor_size() const noexcept {
    return static_cast<std::size_t>(kAnchorChannels) * anchor_width() * anchor_height();
  }
};

/// @pre width_px is a multiple of 16 and height_px is even
LookShape look_shape(int width_px, int height_px) noexcept;

/// @param depth_m  camera.width_px * camera.height_px
/// @param input    [kLookChannels][height][width] of look_shape()
/// @param anchors  [kAnchorChannels][height / 2][width / 2], metres (not scaled)
void first_look_input(std::span<const float> depth_m, const CameraModel& camera, std::span<float> input,
                      std::span<float> anchors) noexcept;

inline constexpr int kMaxCropSize = 1024;

/// The second look's window: half-width `half_width_m` at the centre's depth, size x size samples.
struct CropShape {
  double half_width_m = 1.35;
  int size = 48;
  std::size_t input_size() const noexcept { return static_cast<std::size_t>(kCropChannels) * size * size; }
};

/// Camera-frame ray (z = 1) through the middle of crop sample (column i, row j) of a crop around center_C.
/// @pre center_C.z() >= kCropMinDepth_m
Eigen::Vector3d crop_ray_C(const CropShape& shape, const Eigen::Vector3d& center_C, int i, int j) noexcept;

/// @param input    [kCropChannels][size][size], nearest-neighbour samples
/// @param context  [kCropContext]
/// @return number of samples with a return; 0 says that there is nothing to see around the centre.
/// @pre center_C.z() >= kCropMinDepth_m, shape.size <= kMaxCropSize
int crop_input(std::span<const float> depth_m, const CameraModel& camera, const CropShape& shape,
               const Eigen::Vector3d& center_C, std::span<float> input, std::span<float> context) noexcept;

/// Clean relative depth of the crop, z - center z clamped to +-kCropReach_m, at every `stride`-th sample (the depth
/// decoder's target).
/// @param relative_m  [size / stride][size / stride]; 0 where there is no return
/// @param weight      the same shape; 1 where there is a return
void crop_depth(std::span<const float> depth_m, const CameraModel& camera, const CropShape& shape,
                const Eigen::Vector3d& center_C, int stride, std::span<float> relative_m,
                std::span<float> weight) noexcept;

/// The plain encoder's input: inverse depth and validity of the whole image, [2][height][width].
void plain_input(std::span<const float> depth_m, std::span<float> input) noexcept;

/// An image as another camera at the same place would see it: for every pixel of `to`, the nearest pixel of `from`
/// along its ray. Depth outside to's range, and rays outside from's image, become 0.
void resample_nearest(std::span<const float> depth_m, const CameraModel& from, const CameraModel& to,
                      std::vector<float>* out);

}  // namespace gatefield::model
