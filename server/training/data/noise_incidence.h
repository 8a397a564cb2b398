#pragma once

#include "server/training/data/measured_frames.h"

/// Missing pixels inside of surfaces against how slanted these are. Not for use outside of this folder.
namespace gatefield::training {

/// Part that is missing = square_on + (1 - square_on) loss (1 - cos)^3: a straight line in (1 - cos)^3.
struct IncidenceFit {
  bool seen = false;       ///< enough slanted pixels to tell; else loss is 0
  double slanted_n = 0.0;  ///< pixels at more than 57 deg
  double loss = 0.0;
  double square_on = 0.0;  ///< part that is missing at 0 deg
};

/// Part of the pixels that incidence leaves: 1 - loss (1 - cos)^3.
double kept_part(float cosine, double loss) noexcept;

/// Thread-safe: no (`frames`).   Real-time safe: no.   Errors: none.
IncidenceFit fit_incidence(MeasuredFrames& frames);

}  // namespace gatefield::training
