#include "client/bridge/betaflight/throttle_curve.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace gatefield::bridge::betaflight {
namespace {

constexpr int kPoints = 12;

/// The firmware's own table, 1000 to 2000; its arithmetic is that of whole numbers, and so is this.
std::array<int, kPoints> lookup_table(const msp::RcTuning& tuning) noexcept {
  std::array<int, kPoints> table{};
  for (int i = 0; i < kPoints; ++i) {
    const int t = 10 * i - tuning.throttle_mid;
    int y = 1;
    if (t > 0) y = 100 - tuning.throttle_mid;
    if (t < 0) y = tuning.throttle_mid;
    y = std::max(y, 1);
    const int bent = 100 - tuning.throttle_expo + tuning.throttle_expo * (t * t) / (y * y);
    table[static_cast<std::size_t>(i)] = 1000 + (10 * tuning.throttle_mid + t * bent / 10);
  }
  return table;
}

double limited(double throttle, const msp::RcTuning& tuning) noexcept {
  const double factor = tuning.throttle_limit_percent / 100.0;
  switch (tuning.throttle_limit) {
    case msp::RcTuning::ThrottleLimit::kOff:
      break;
    case msp::RcTuning::ThrottleLimit::kScale:
      return throttle * factor;
    case msp::RcTuning::ThrottleLimit::kClip:
      return std::min(throttle, factor);
  }
  return throttle;
}

}  // namespace

ThrottleCurve::ThrottleCurve(const msp::RcTuning& tuning, const msp::RxConfig& config) noexcept
    : lowest_us_(std::clamp(config.min_check, kLowest_us, kHighest_us - 1)) {
  const auto table = lookup_table(tuning);
  double reached = 0.0;
  for (int us = kLowest_us; us <= kHighest_us; ++us) {
    const int above = std::max(us, config.min_check) - config.min_check;
    const int stretched = above * 1000 / (kHighest_us - config.min_check);
    const auto step = static_cast<std::size_t>(std::min(stretched / 100, kPoints - 2));
    const int pulse = table[step] + (stretched - static_cast<int>(step) * 100) * (table[step + 1] - table[step]) / 100;
    reached = std::max(reached, limited(std::clamp((pulse - 1000) / 1000.0, 0.0, 1.0), tuning));
    throttles_[static_cast<std::size_t>(us - kLowest_us)] = reached;
  }
}

int ThrottleCurve::pulse_us(double throttle) const noexcept {
  if (!std::isfinite(throttle)) return lowest_us_;
  const auto* above = std::lower_bound(throttles_.begin(), throttles_.end(), std::min(throttle, max_throttle()));
  if (above != throttles_.begin() && throttle - *(above - 1) < *above - throttle) --above;
  return std::max(kLowest_us + static_cast<int>(above - throttles_.begin()), lowest_us_);
}

double ThrottleCurve::throttle(int pulse_us) const noexcept {
  assert(pulse_us >= kLowest_us && pulse_us <= kHighest_us);
  return throttles_[static_cast<std::size_t>(pulse_us - kLowest_us)];
}

}  // namespace gatefield::bridge::betaflight
