#pragma once

#include <functional>
#include <string>
#include <vector>

#include "server/training/evaluation/frame.h"

namespace gatefield::training {

/// A kind of frames that gets a row of its own.
struct Group {
  std::string by;    ///< "distance", "angle", "visibility", "gates in view", "together"
  std::string name;  ///< "1 to 2 m"
  std::function<bool(const GateFacts&)> holds;
};

/// Every frame with a gate belongs to exactly one group of each `by` but "together", which has "core" (1 to 4 m, below
/// 60 deg, at least half visible) and "all".
const std::vector<Group>& groups();

/// Means and quantiles over the frames of one group.
struct Summary {
  int count = 0;
  double all_m = 0.0, near_m = 0.0;
  double box_m = 0.0, box_median_m = 0.0;
  double sign_percent = 0.0, sign_median_percent = 0.0;
  double center_median_m = 0.0, center_p90_m = 0.0;
  double normal_median_deg = 0.0, normal_p90_deg = 0.0;
  double encoder_center_median_m = 0.0;
  double fitted_percent = 0.0;
  double valid_percent = 0.0;  ///< validity above the bundle's threshold
};
Summary summarize(const std::vector<const Measured*>& frames, double validity_threshold);

/// What someone who sees nothing would score on the same frames: the best constant field, and always the same centre
/// (the median place in the camera's frame) and axis (the main direction). All NaN without frames.
struct Constant {
  double all_m = 0.0, near_m = 0.0, box_m = 0.0, sign_percent = 0.0;
  double center_median_m = 0.0, normal_median_deg = 0.0;
  double prior_median_m = 0.0;  ///< the prior itself taken for the centre
};
Constant constant_baseline(const std::vector<const FrameTruth*>& frames);

}  // namespace gatefield::training
