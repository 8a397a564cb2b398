#include "client/simulator/battery.h"

#include <algorithm>
#include <cmath>
#include <iterator>

namespace gatefield::simulator {
namespace {

struct Point {
  double charge, volts;
};
constexpr Point kCell[] = {{0.0, 3.30}, {0.1, 3.65}, {0.3, 3.76}, {0.5, 3.83}, {0.7, 3.95}, {0.9, 4.10}, {1.0, 4.20}};
constexpr double kHalf_v = 3.83;

double at_rest(double charge) noexcept {
  const auto* above = std::find_if(std::begin(kCell) + 1, std::end(kCell) - 1,
                                   [charge](const Point& point) { return charge <= point.charge; });
  const Point& low = above[-1];
  const double share = (std::clamp(charge, 0.0, 1.0) - low.charge) / (above->charge - low.charge);
  return (low.volts + share * (above->volts - low.volts)) / kHalf_v;
}

}  // namespace

double Battery::voltage(double charge, double power) const noexcept {
  const double u = at_rest(charge);
  // Beyond the most that it can deliver the voltage stays at half.
  return 0.5 * (u + std::sqrt(std::max(u * u - 4.0 * sag_ * power, 0.0)));
}

double Battery::factor(double power) const noexcept {
  const double x = voltage(charge_, power) / voltage(0.5, 1.0);
  return x * x;
}

void Battery::spend(double power, double dt_s) noexcept { charge_ = std::max(charge_ - power * dt_s / hover_s_, 0.0); }

}  // namespace gatefield::simulator
