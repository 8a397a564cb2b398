#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <span>
#include <vector>

#include "common/geometry/camera.h"

/// Errors of the disparity in flat windows: where nothing but a plane is seen, what is left of it is the sensor's.
/// Disparities d = focal baseline / z and lengths are in the sensor's own pixels, whatever frames were decimated to.
namespace gatefield::training {

/// The sensor behind the frames.
struct SensorGeometry {
  CameraModel camera;     ///< of the frames
  double focal_px = 0.0;  ///< of the sensor's own images
  double baseline_m = 0.0;

  double scale_px() const noexcept { return camera.fx_px / focal_px; }  ///< image pixels in one of the sensor's
  float focal_baseline() const noexcept { return static_cast<float>(focal_px * baseline_m); }
};

/// By distance, and one for all.
inline constexpr std::array kStatisticsFrom_m{0.3, 1.0, 2.0, 3.0, 5.0, 8.0};
inline constexpr std::size_t kBins = kStatisticsFrom_m.size();
/// Sides of the windows in which planes are taken off, sensor pixels.
inline constexpr std::array kWindows_px{15.0, 31.0, 61.0};
/// Lags of the differences within windows of kWindows_px[1].
inline constexpr std::array kLags_px{2.0, 4.0, 8.0, 16.0};
inline constexpr std::size_t kMoments = kWindows_px.size() + kLags_px.size();

/// Second moments of the disparity in flat windows: [0..2] variance after a plane was taken off, by size; then half the
/// mean square of the difference of two pixels in a row, by lag. Mean of the lower three quarters of the windows:
/// furniture is in the upper one.
struct FlatMoments {
  std::array<double, kMoments> px2{};
  std::size_t windows = 0;  ///< of the middle size
  double at_m = 0.0;        ///< mean distance
};

/// Moments of single windows, before they are averaged.
struct FlatWindows {
  std::array<std::array<std::vector<double>, kMoments>, kBins> px2;
  std::array<double, kBins> distance_sum_m{};  ///< over windows of the middle size

  void add(const FlatWindows& others);
  FlatMoments moments(std::size_t bin) const;
};

/// Adds an image's windows. @param z_of  distance of a window of this mean disparity
/// Thread-safe: yes.   Real-time safe: no.
void collect_windows(const SensorGeometry& geometry, std::span<const float> d_px,
                     const std::function<double(double)>& z_of, FlatWindows* all);

/// Mean of the lower three quarters; NaN without any.
double lower_mean(std::vector<double> values);

/// Sensor pixels as whole pixels of the image.
int image_pixels(double sensor_px, double scale_px, int least) noexcept;

}  // namespace gatefield::training
