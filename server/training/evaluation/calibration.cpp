#include "server/training/evaluation/calibration.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "common/base/statistics.h"
#include "server/training/evaluation/statistics.h"

namespace gatefield::training {
namespace {

std::vector<std::size_t> order_of(const std::vector<double>& values) {
  std::vector<std::size_t> order(values.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return values[a] < values[b]; });
  return order;
}

}  // namespace

std::vector<CalibrationBin> calibrate(const std::vector<double>& predicted_m, const std::vector<double>& actual_m,
                                      int bins) {
  const std::vector<std::size_t> order = order_of(predicted_m);
  const std::size_t count = std::min(order.size(), static_cast<std::size_t>(bins));
  std::vector<CalibrationBin> out;
  for (std::size_t bin = 0; bin < count; ++bin) {
    std::vector<double> predicted, actual;
    for (std::size_t i = bin * order.size() / count; i < (bin + 1) * order.size() / count; ++i) {
      predicted.push_back(predicted_m[order[i]]);
      actual.push_back(actual_m[order[i]]);
    }
    out.push_back({static_cast<int>(actual.size()), mean(predicted), mean(actual), quantile(actual, 0.5),
                   quantile(actual, 0.1), quantile(actual, 0.9)});
  }
  return out;
}

double calibration_error(const std::vector<CalibrationBin>& bins) {
  double sum = 0.0, count = 0.0;
  for (const CalibrationBin& bin : bins) {
    sum += bin.count * std::abs(bin.predicted_m - bin.actual_m);
    count += bin.count;
  }
  return count > 0.0 ? sum / count : std::numeric_limits<double>::quiet_NaN();
}

std::vector<RiskPoint> risk_coverage(const std::vector<double>& predicted_m, const std::vector<double>& actual_m,
                                     int points) {
  const std::vector<std::size_t> order = order_of(predicted_m);
  std::vector<double> sorted = actual_m;
  std::sort(sorted.begin(), sorted.end());
  std::vector<RiskPoint> out;
  double sum = 0.0, best = 0.0;
  std::size_t taken = 0;
  for (int point = 1; point <= points; ++point) {
    const std::size_t upto = order.size() * static_cast<std::size_t>(point) / static_cast<std::size_t>(points);
    for (; taken < upto; ++taken) {
      sum += actual_m[order[taken]];
      best += sorted[taken];
    }
    if (taken == 0) continue;
    const auto n = static_cast<double>(taken);
    out.push_back({n / static_cast<double>(order.size()), predicted_m[order[taken - 1]], sum / n, best / n});
  }
  return out;
}

}  // namespace gatefield::training
