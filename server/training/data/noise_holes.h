#pragma once

#include <cstddef>

#include "server/training/data/measured_frames.h"

/// Holes: regions that are missing altogether, which single losses hardly ever make. Not for use outside of this
/// folder.
namespace gatefield::training {

struct Holes {
  double per_pixel = 0.0;
  double radius_px = 0.0;
  double covered = 0.0;  ///< part of the image
};

struct HoleFit {
  bool seen = false;  ///< enough windows to tell
  Holes holes;
  double lost_otherwise = 0.0;  ///< part of the pixels that is missing neither by holes nor by incidence

  bool any() const noexcept { return holes.covered > 2e-4; }
  /// Whether nothing is missing but by holes and incidence.
  bool nothing_else() const noexcept { return seen && lost_otherwise < 0.003; }
};

inline constexpr int kSmallestWindow_px = 3;  ///< windows that holes are looked for with: 3 x 3 to 7 x 7
inline constexpr std::size_t kWindows = 5;
inline constexpr int kLargestWindow_px = kSmallestWindow_px + static_cast<int>(kWindows) - 1;

/// How the number of windows that miss all their pixels falls with the window's size gives the radius, their number how
/// many holes there are. Windows touch no edge, no shadow and no surface that stands steeper than 53 deg.
/// @param incidence_loss  of noise_incidence.h, taken off what is missing
/// Thread-safe: no (`frames`).   Real-time safe: no.   Errors: none.
HoleFit fit_holes(MeasuredFrames& frames, double incidence_loss);

}  // namespace gatefield::training
