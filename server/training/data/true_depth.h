#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/geometry/camera.h"

namespace gatefield::training {

/// What is known about each pixel of a true depth image, before one looks at what a sensor made of it. Row-major.
struct TrueDepth {
  /// Pixels as far as this from any edge are 'inside'.
  static constexpr int kInside_px = 3;

  std::vector<float> z_m;     ///< 0 = nothing, or not known
  std::vector<float> cosine;  ///< of the angle of incidence, from the slopes of 1 / z; 0 where z is 0
  /// A neighbour (4) has another depth, as apply_noise() sees it: more than 0.1 m + 3 %.
  std::vector<std::uint8_t> edge;
  std::vector<std::uint8_t> border;  ///< a neighbour (4) has none
  std::vector<std::uint8_t> inside;  ///< known, no edge and nothing unknown within kInside_px
  std::vector<std::uint8_t> shadow;  ///< hidden from an imager `baseline_m` to the right

  /// True when z and other are of different surfaces.
  static bool differs(float z_m, float other_m) noexcept;
};

/// @pre z_m has camera.width_px * camera.height_px values.
/// Thread-safe: yes.   Real-time safe: allocates when *truth has another size.
void examine(const CameraModel& camera, double baseline_m, std::span<const float> z_m, TrueDepth* truth);

}  // namespace gatefield::training
