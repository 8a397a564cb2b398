#include "server/training/evaluation/statistics.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <span>

#include "common/base/statistics.h"

namespace gatefield::training {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

std::vector<double> ranks(const std::vector<double>& values) {
  std::vector<std::size_t> order(values.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return values[a] < values[b]; });
  std::vector<double> out(values.size());
  for (std::size_t begin = 0; begin < order.size();) {
    std::size_t end = begin + 1;
    while (end < order.size() && values[order[end]] == values[order[begin]]) ++end;
    const double shared = 0.5 * static_cast<double>(begin + end - 1);
    for (std::size_t i = begin; i < end; ++i) out[order[i]] = shared;
    begin = end;
  }
  return out;
}

}  // namespace

double mean(const std::vector<double>& values) {
  if (values.empty()) return kNone;
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

double spearman(const std::vector<double>& a, const std::vector<double>& b) {
  if (a.size() < 3) return kNone;
  const std::vector<double> ranks_a = ranks(a);
  const std::vector<double> ranks_b = ranks(b);
  const double middle = 0.5 * static_cast<double>(a.size() - 1);
  double ab = 0.0, aa = 0.0, bb = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    ab += (ranks_a[i] - middle) * (ranks_b[i] - middle);
    aa += (ranks_a[i] - middle) * (ranks_a[i] - middle);
    bb += (ranks_b[i] - middle) * (ranks_b[i] - middle);
  }
  return aa > 0.0 && bb > 0.0 ? ab / std::sqrt(aa * bb) : kNone;
}

double constant_error(std::vector<float> truth) {
  if (truth.empty()) return kNone;
  const double constant = quantile_in_place(std::span(truth), 0.5);
  double sum = 0.0;
  for (const float value : truth) sum += std::abs(static_cast<double>(value) - constant);
  return sum / static_cast<double>(truth.size());
}

double constant_sign_percent(const std::vector<float>& truth) {
  if (truth.empty()) return kNone;
  const auto positive = std::count_if(truth.begin(), truth.end(), [](float value) { return value > 0.0f; });
  const double part = static_cast<double>(positive) / static_cast<double>(truth.size());
  return 100.0 * std::max(part, 1.0 - part);
}

}  // namespace gatefield::training
