#pragma once

#include "server/training/data/measured_frames.h"
#include "server/training/data/noise_disparity.h"

/// What happens at the edges of surfaces: pixels that take the depth of the other side, pixels that the second imager
/// can't see. Not for use outside of this folder.
namespace gatefield::training {

struct EdgeFit {
  double bleed = 0.0;            ///< pixels that moved towards the other side, less those that speckle moved
  double bleed_expected = 0.0;   ///< pixels that would have, were the probability 1
  double bleed_n = 0.0;          ///< pixels that were looked at
  double shadow_kept = 0.0;      ///< hidden from the second imager and there all the same
  double shadow_expected = 0.0;  ///< those that incidence and other losses would leave
  double shadow_n = 0.0;         ///< pixels that are hidden

  bool bleed_seen() const noexcept { return bleed_expected > 0.25 * kEnough; }
  bool shadow_seen() const noexcept { return shadow_expected > 0.25 * kEnough; }
};

/// @param square_on            part that is missing whatever the incidence (noise_incidence.h)
/// @param speckle_probability  of a pixel that takes any depth
/// Thread-safe: no (`frames`).   Real-time safe: no.   Errors: none.
EdgeFit fit_edges(MeasuredFrames& frames, const DisparityFit& disparity, double incidence_loss, double square_on,
                  double speckle_probability);

}  // namespace gatefield::training
