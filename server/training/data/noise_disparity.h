#pragma once

#include "common/base/result.h"
#include "server/training/data/measured_frames.h"

/// Errors of the disparity inside of surfaces: noise, quantisation, wrong matches. Not for use outside of this folder.
namespace gatefield::training {

/// Disparity d = fx baseline / z, pixels.
struct DisparityFit {
  double pixels = 0.0;          ///< errors that were looked at
  double bias_px = 0.0;         ///< mean error
  double spread_px = 0.0;       ///< standard deviation, clipped at 3 sigma
  double noise_px = 0.0;        ///< of the spread, what neither the step nor the file's millimetres make
  double step_px = 0.0;         ///< of which the disparities are multiples; 0: none, < 0: too few pixels to tell
  double wrong = 0.0;           ///< pixels beyond limit_px()
  double could_be_wrong = 0.0;  ///< pixels, each counted by the part of the depth range that lies beyond
  float scale_m_px = 0.0f;

  bool speckle_seen() const noexcept { return could_be_wrong > kEnough; }
  /// What noise alone hardly ever exceeds at depth z: 6 sigma, and 1.5 mm.
  float limit_px(float z_m) const noexcept;
};

/// Errors: too few measured pixels inside of surfaces. Thread-safe: no (`frames`).   Real-time safe: no.
Result<DisparityFit> fit_disparity(MeasuredFrames& frames);

}  // namespace gatefield::training
