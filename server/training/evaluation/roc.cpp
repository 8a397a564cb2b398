#include "server/training/evaluation/roc.h"

#include <algorithm>
#include <limits>

namespace gatefield::training {

std::vector<RocPoint> roc_curve(const std::vector<double>& positives, const std::vector<double>& negatives) {
  if (positives.empty() || negatives.empty()) return {};
  struct Scored {
    double score;
    bool positive;
  };
  std::vector<Scored> all;
  for (const double score : positives) all.push_back({score, true});
  for (const double score : negatives) all.push_back({score, false});
  std::sort(all.begin(), all.end(), [](const Scored& a, const Scored& b) { return a.score > b.score; });
  std::vector<RocPoint> curve{{std::numeric_limits<double>::infinity(), 0.0, 0.0}};
  double kept = 0.0, false_alarms = 0.0;
  for (std::size_t i = 0; i < all.size(); ++i) {
    (all[i].positive ? kept : false_alarms) += 1.0;
    if (i + 1 < all.size() && all[i + 1].score == all[i].score) continue;  // equal scores come together
    curve.push_back({all[i].score, kept / static_cast<double>(positives.size()),
                     false_alarms / static_cast<double>(negatives.size())});
  }
  return curve;
}

double area_under(const std::vector<RocPoint>& curve) {
  if (curve.empty()) return std::numeric_limits<double>::quiet_NaN();
  double area = 0.0;
  for (std::size_t i = 1; i < curve.size(); ++i)
    area += 0.5 * (curve[i].kept + curve[i - 1].kept) * (curve[i].false_alarms - curve[i - 1].false_alarms);
  return area;
}

RocPoint keeping(const std::vector<RocPoint>& curve, double part) {
  for (const RocPoint& point : curve)
    if (point.kept >= part) return point;
  return curve.back();
}

RocPoint at_threshold(const std::vector<RocPoint>& curve, double threshold) {
  RocPoint out = curve.front();
  for (const RocPoint& point : curve) {
    if (point.threshold < threshold) break;
    out = point;
  }
  out.threshold = threshold;
  return out;
}

}  // namespace gatefield::training
