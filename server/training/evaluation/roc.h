#pragma once

#include <vector>

namespace gatefield::training {

/// How well a score tells two kinds apart: what should be kept (positives) and what should be recognised as empty
/// (negatives). Kept is what scores at least the threshold.
struct RocPoint {
  double threshold = 0.0;
  double kept = 0.0;          ///< part of the positives that is kept
  double false_alarms = 0.0;  ///< part of the negatives that is kept
};

/// One point for every threshold that makes a difference, from "keeps nothing" to "keeps all". Empty when there are no
/// positives or no negatives. @pre no NaN
std::vector<RocPoint> roc_curve(const std::vector<double>& positives, const std::vector<double>& negatives);

/// Area under the curve: the part of all pairs in which the positive scores higher; a tie counts half. NaN when empty.
double area_under(const std::vector<RocPoint>& curve);

/// The strictest threshold that keeps at least `part` of the positives. @pre the curve is not empty, 0 <= part <= 1
RocPoint keeping(const std::vector<RocPoint>& curve, double part);
/// What a given threshold does. @pre the curve is not empty
RocPoint at_threshold(const std::vector<RocPoint>& curve, double threshold);

}  // namespace gatefield::training
