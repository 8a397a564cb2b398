#include "client/flight/thrust_estimate.h"

#include <algorithm>
#include <cmath>

#include "common/base/text.h"

namespace gatefield::flight {
namespace {

// Uncertainty at the beginning: a hover throttle from a data sheet or another battery, an exponent from the propellers.
constexpr double kFirstSigma = 0.3;          // of a = ln of the thrust's factor
constexpr double kFirstExponentSigma = 0.3;  // of p
// Random walks: propellers chip, motors warm up. PX4's hover thrust walks by about 1 % of itself in a second.
constexpr double kWalk = 0.01;            // of a, per square root of a second
constexpr double kExponentWalk = 0.003;   // of p
constexpr double kForceSigma_m_s2 = 0.8;  // accelerometer after smoothing: vibration, gusts, what the model leaves out
constexpr double kModelSigma = 0.03;      // of ln F: the curve is no power, the mixer takes a little
constexpr double kGate = 3.0;             // standard deviations
constexpr double kLeastForce = 0.2;       // of gravity
constexpr double kExponentMin = 1.0, kExponentMax = 2.5;
constexpr double kLongestGap_s = 0.1;  // states farther apart begin anew
constexpr double kBatterySmoothing = 0.1;

double share(double dt_s, double time_constant_s) noexcept {
  return time_constant_s > 0 ? 1.0 - std::exp(-dt_s / time_constant_s) : 1.0;
}

}  // namespace

Status validate(const ThrustOptions& options) {
  struct Range {
    const char* field;
    double value, low, high;
  };
  for (const Range& range :
       {Range{"hover_throttle", options.hover_throttle, 0.03, 0.9},
        Range{"exponent", options.exponent, kExponentMin, kExponentMax},
        Range{"throttle_min", options.throttle_min, 0.0, 0.5},
        Range{"throttle_max", options.throttle_max, options.throttle_min + 0.1, 1.0},
        Range{"lag_s", options.lag_s, 0.0, 0.3}, Range{"trusted_factor", options.trusted_factor, 1.05, 3.0}})
    if (!(range.value >= range.low && range.value <= range.high))
      return Error::invalid(range.field, text(range.value), text(range.low) + " to " + text(range.high));
  if (options.reference_v != 0.0 && !(options.reference_v >= 2.0 && options.reference_v <= 100.0))
    return Error::invalid("reference_v", text(options.reference_v) + " V", "2 to 100 V, or 0 for not used");
  if (!(options.hover_throttle > options.throttle_min && options.hover_throttle < options.throttle_max))
    return Error::invalid("hover_throttle", text(options.hover_throttle),
                          "between throttle_min (" + text(options.throttle_min) + ") and throttle_max (" +
                              text(options.throttle_max) + ")");
  return {};
}

ThrustEstimate::ThrustEstimate(const ThrustOptions& options, const QuadrotorModel& model) noexcept
    : options_(options), mass_kg_(model.mass_kg), drag_z_kg_s_(model.drag_kg_s.z()), x_(0.0, options.exponent) {
  P_ << kFirstSigma * kFirstSigma, 0, 0, kFirstExponentSigma * kFirstExponentSigma;
}

double ThrustEstimate::voltage_ratio() const noexcept {
  return options_.reference_v > 0 && battery_v_ ? *battery_v_ / options_.reference_v : 1.0;
}

double ThrustEstimate::throttle(double collective_n) const noexcept {
  if (!(collective_n > 0) || !std::isfinite(collective_n)) return options_.throttle_min;
  const double xi = (std::log(collective_n / (mass_kg_ * kGravity_m_s2)) - x_[0]) / x_[1];
  return std::clamp(options_.hover_throttle * std::exp(xi) / voltage_ratio(), options_.throttle_min,
                    options_.throttle_max);
}

double ThrustEstimate::collective_n(double throttle) const noexcept {
  if (!(throttle > 0)) return 0.0;
  const double xi = std::log(throttle * voltage_ratio() / options_.hover_throttle);
  return mass_kg_ * kGravity_m_s2 * std::exp(x_[0] + x_[1] * xi);
}

double ThrustEstimate::command(Stamp now, double collective_n) noexcept {
  const double asked = throttle(collective_n);
  if (!sent_) lagged_throttle_ = asked * voltage_ratio();
  // What was sent last has held until now; the lag goes on from there.
  const double dt_s = sent_ ? std::max(0.0, seconds(now - sent_->when)) : 0.0;
  if (sent_) lagged_throttle_ += share(dt_s, options_.lag_s) * (sent_->throttle * voltage_ratio() - lagged_throttle_);
  const bool limited = asked <= options_.throttle_min || asked >= options_.throttle_max;
  free_for_s_ = limited ? 0.0 : free_for_s_ + dt_s;
  sent_ = Sent{now, asked};
  return asked;
}

void ThrustEstimate::end() noexcept {
  learning_ = false;
  sent_.reset();
  smoothed_.reset();
  felt_at_.reset();
  velocity_.reset();
  only_outliers_s_ = free_for_s_ = 0.0;
}

void ThrustEstimate::on_battery(double battery_v) noexcept {
  if (!(std::abs(battery_v - options_.reference_v) <= 0.5 * options_.reference_v)) return;
  battery_v_ = battery_v_ ? *battery_v_ + kBatterySmoothing * (battery_v - *battery_v_) : battery_v;
}

// Thrust over mass, m/s^2.
std::optional<double> ThrustEstimate::felt(Stamp stamp, const QuadrotorState& state,
                                           std::optional<double> specific_force) noexcept {
  const Eigen::Matrix3d R_WB = state.q_WB.toRotationMatrix();
  const double v_z_m_s = R_WB.col(2).dot(state.v_WB);
  if (!specific_force) {
    if (!velocity_ || !felt_at_) return std::nullopt;
    const Eigen::Vector3d a_W = (state.v_WB - *velocity_) / seconds(stamp - *felt_at_);
    specific_force = R_WB.col(2).dot(a_W + Eigen::Vector3d(0, 0, kGravity_m_s2));
  }
  return *specific_force + drag_z_kg_s_ * v_z_m_s / mass_kg_;
}

void ThrustEstimate::on_state(Stamp stamp, const QuadrotorState& state,
                              std::optional<double> specific_force_z_m_s2) noexcept {
  if (!learning_ || !sent_) return;
  const double dt_s = felt_at_ ? seconds(stamp - *felt_at_) : 0.0;
  if (felt_at_ && dt_s <= 0) return;  // the same state again
  const bool follows = felt_at_ && dt_s <= kLongestGap_s;
  if (!follows) smoothed_.reset(), velocity_.reset();
  const auto force = felt(stamp, state, specific_force_z_m_s2);
  felt_at_ = stamp;
  velocity_ = state.v_WB;
  if (!force || !std::isfinite(*force) || !std::isfinite(lagged_throttle_)) return;

  if (!smoothed_) {
    smoothed_ = Smoothed{lagged_throttle_, *force};
    return;
  }
  smoothed_->throttle += share(dt_s, kSmooth_s) * (lagged_throttle_ - smoothed_->throttle);
  smoothed_->force += share(dt_s, kSmooth_s) * (*force - smoothed_->force);
  if (free_for_s_ < 3 * (options_.lag_s + kSmooth_s) || smoothed_->force < kLeastForce * kGravity_m_s2 ||
      smoothed_->throttle <= 0)
    return;
  const double sigma = std::hypot(kForceSigma_m_s2 / smoothed_->force, kModelSigma);
  learn(std::log(smoothed_->throttle / options_.hover_throttle), std::log(smoothed_->force / kGravity_m_s2), sigma,
        dt_s);
}

void ThrustEstimate::learn(double xi, double log_force, double sigma, double dt_s) noexcept {
  P_(0, 0) = std::min(P_(0, 0) + kWalk * kWalk * dt_s, kFirstSigma * kFirstSigma);
  P_(1, 1) = std::min(P_(1, 1) + kExponentWalk * kExponentWalk * dt_s, kFirstExponentSigma * kFirstExponentSigma);

  // Smoothed samples repeat each other: each tells as much as its share of two time constants.
  const double R = sigma * sigma * std::max(1.0, 2 * kSmooth_s / dt_s);
  const Eigen::RowVector2d H(1.0, xi);
  const Eigen::Vector2d PH = P_ * H.transpose();
  const double innovation = log_force - H.dot(x_);
  const double spread = H.dot(PH) + sigma * sigma;  // of one sample by itself
  if (innovation * innovation > kGate * kGate * spread) {
    ++outliers_;
    only_outliers_s_ += dt_s;
    if (only_outliers_s_ < kRestart_s) return;
    P_ << kFirstSigma * kFirstSigma, 0, 0, kFirstExponentSigma * kFirstExponentSigma;
    only_outliers_s_ = 0.0;
    return;
  }
  only_outliers_s_ = 0.0;
  ++taken_;
  const Eigen::Vector2d gain = PH / (H.dot(PH) + R);
  x_ += gain * innovation;
  // Joseph's form stays symmetric and positive whatever the rounding.
  const Eigen::Matrix2d keep = Eigen::Matrix2d::Identity() - gain * H;
  P_ = keep * P_ * keep.transpose() + R * gain * gain.transpose();
  keep_within_bounds();
}

void ThrustEstimate::keep_within_bounds() noexcept {
  x_[1] = std::clamp(x_[1], kExponentMin, kExponentMax);
  const double most = x_[1] * std::log(kMaxFactor);
  x_[0] = std::clamp(x_[0], -most, most);
}

double ThrustEstimate::hover_throttle() const noexcept { return options_.hover_throttle * std::exp(-x_[0] / x_[1]); }

double ThrustEstimate::factor() const noexcept { return std::exp(x_[0]); }

double ThrustEstimate::uncertainty() const noexcept { return std::sqrt(P_(0, 0)); }

bool ThrustEstimate::contradicts() const noexcept {
  return std::abs(x_[0]) - 2 * uncertainty() > std::log(options_.trusted_factor);
}

Status agreement(const ThrustEstimate& estimate, const ThrustOptions& options) {
  if (!estimate.contradicts()) return {};
  return Error::invalid("hover_throttle", brief(options.hover_throttle),
                        "about " + fixed(estimate.hover_throttle(), 3) + ", as this flight shows (thrust is " +
                            fixed(estimate.factor(), 2) +
                            " times what was told: check mass, propellers, battery and the throttle's scale)");
}

}  // namespace gatefield::flight
