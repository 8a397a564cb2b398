#include "client/bridge/betaflight/stick_curve.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>

namespace gatefield::bridge::betaflight {
namespace {

using Axis = msp::RcTuning::Axis;
using Type = msp::RcTuning::RatesType;

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kMax_deg_s = 1998.0;  // the firmware's own limit of all setpoints

/// Formulas for x in [0, 1]; they are odd.
double actual(const Axis& axis, double x) noexcept {
  const double expo = axis.expo / 100.0;
  const double centre = axis.rc_rate * 10.0;
  const double outer = std::max(0.0, axis.super_rate * 10.0 - centre);
  return x * centre + outer * x * (std::pow(x, 5) * expo + x * (1 - expo));
}

double sharpened(double x, double factor) noexcept { return 1.0 / std::clamp(1.0 - x * factor, 0.01, 1.0); }

double betaflight(const Axis& axis, double x) noexcept {
  const double expo = axis.expo / 100.0;
  const double rate = axis.rc_rate / 100.0;
  const double curved = x * std::pow(x, 3) * expo + x * (1 - expo);
  return 200.0 * (rate + 14.54 * std::max(0.0, rate - 2.0)) * curved * sharpened(x, axis.super_rate / 100.0);
}

double kiss(const Axis& axis, double x) noexcept {
  const double expo = axis.expo / 100.0;
  const double curved = std::pow(x, 3) * expo + x * (1 - expo);
  return 2000.0 * sharpened(x, axis.super_rate / 100.0) * curved * axis.rc_rate / 1000.0;
}

double quick(const Axis& axis, double x) noexcept {
  const double centre = axis.rc_rate * 2.0;
  if (centre == 0) return 0.0;
  const double outer = std::max(axis.super_rate * 10.0, centre);
  const double expo = axis.expo / 100.0;
  const double curved = std::pow(x, 3) * expo + x * (1 - expo);
  return x * centre * sharpened(curved, 1.0 - centre / outer);
}

double raceflight(const Axis& axis, double x) noexcept {
  const double curved = (1.0 + 0.01 * axis.expo * (x * x - 1.0)) * x;
  return 10.0 * axis.rc_rate * curved * (1.0 + x * axis.super_rate * 0.01);
}

double rate_deg_s(Type type, const Axis& axis, double x) noexcept {
  switch (type) {
    case Type::kBetaflight:
      return betaflight(axis, x);
    case Type::kRaceflight:
      return raceflight(axis, x);
    case Type::kKiss:
      return kiss(axis, x);
    case Type::kActual:
      return actual(axis, x);
    case Type::kQuick:
      return quick(axis, x);
  }
  return 0.0;
}

}  // namespace

StickCurve::StickCurve(Type type, const Axis& axis, int deadband_us) noexcept {
  assert(deadband_us >= 0 && deadband_us <= kTravel / 2);
  const double limit = std::min<double>(axis.limit_deg_s, kMax_deg_s);
  double reached = 0.0;
  for (int us = 0; us <= kTravel; ++us) {
    const double x = static_cast<double>(std::max(0, us - deadband_us)) / (kTravel - deadband_us);
    // A curve of odd settings may turn back; from there on more stick asks for nothing more.
    reached = std::max(reached, std::min(rate_deg_s(type, axis, x), limit));
    rates_rad_s_[static_cast<std::size_t>(us)] = reached * kDegree;
  }
}

int StickCurve::deflection_us(double rate_rad_s) const noexcept {
  if (!std::isfinite(rate_rad_s)) return 0;
  const double wanted = std::abs(rate_rad_s);
  const auto* const above = std::lower_bound(rates_rad_s_.begin(), rates_rad_s_.end(), wanted);
  auto place = above - rates_rad_s_.begin();
  if (above == rates_rad_s_.end()) {
    place = std::lower_bound(rates_rad_s_.begin(), rates_rad_s_.end(), max_rad_s()) - rates_rad_s_.begin();
  } else if (place > 0 && wanted - *(above - 1) < *above - wanted) {
    --place;
  }
  return static_cast<int>(rate_rad_s < 0 ? -place : place);
}

double StickCurve::rate_rad_s(int deflection_us) const noexcept {
  assert(std::abs(deflection_us) <= kTravel);
  const double rate = rates_rad_s_[static_cast<std::size_t>(std::abs(deflection_us))];
  return deflection_us < 0 ? -rate : rate;
}

}  // namespace gatefield::bridge::betaflight
