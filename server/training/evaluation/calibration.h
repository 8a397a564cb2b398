#pragma once

#include <vector>

namespace gatefield::training {

/// Frames whose predicted errors are alike, and what their errors really are.
struct CalibrationBin {
  int count = 0;
  double predicted_m = 0.0;  ///< mean
  double actual_m = 0.0;     ///< mean
  double actual_median_m = 0.0;
  double actual_p10_m = 0.0, actual_p90_m = 0.0;
};

/// Frames in order of their predicted error, cut into `bins` groups of equal size (to one frame). Fewer groups when
/// there are fewer frames. @pre equal sizes, bins >= 1, no NaN
std::vector<CalibrationBin> calibrate(const std::vector<double>& predicted_m, const std::vector<double>& actual_m,
                                      int bins);

/// Mean over the bins, weighted by their frames, of |predicted - actual|: 0 when predictions are right on average.
double calibration_error(const std::vector<CalibrationBin>& bins);

/// What is left when the frames with the largest predicted errors are given up.
struct RiskPoint {
  double coverage = 0.0;     ///< part of the frames that is kept
  double threshold_m = 0.0;  ///< largest predicted error among them
  double mean_m = 0.0;       ///< their mean error
  double best_m = 0.0;       ///< the same if the errors themselves decided which frames are kept: no prediction does
                             ///< better
};
/// At `points` coverages 1 / points, 2 / points, ..., 1. @pre equal sizes, no NaN
std::vector<RiskPoint> risk_coverage(const std::vector<double>& predicted_m, const std::vector<double>& actual_m,
                                     int points);

}  // namespace gatefield::training
