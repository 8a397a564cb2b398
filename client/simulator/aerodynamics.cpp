#include "client/simulator/aerodynamics.h"

#include <algorithm>
#include <cmath>

#include "common/base/random.h"

namespace gatefield::simulator {
namespace {

double longest_arm_m(const QuadrotorModel& model) {
  double arm_m = 0.0;
  for (const PlainVector2& p_B : model.rotor_position_B_m) arm_m = std::max(arm_m, p_B.norm());
  return arm_m;
}

}  // namespace

std::optional<Aerodynamics> Aerodynamics::create(const config::AirErrors& air, const QuadrotorModel& model,
                                                 const scene::World& world, std::uint64_t seed) {
  if (!air.any()) return std::nullopt;
  return Aerodynamics(air, model, world, seed);
}

Aerodynamics::Aerodynamics(const config::AirErrors& air, const QuadrotorModel& model, const scene::World& world,
                           std::uint64_t seed) noexcept
    : model_(model),
      radius_m_(0.5 * air.rotor_diameter * longest_arm_m(model)),
      ground_effect_(air.ground_effect && world.has_floor),
      floor_z_m_(world.floor_z_m) {
  const double arm_m = longest_arm_m(model);
  drag_kg_m_ = 0.5 * kAirDensity_kg_m3 * arm_m * arm_m *
               Eigen::Vector3d(air.drag_area_level, air.drag_area_level, air.drag_area_axial);
  if (air.advance_ratio > 0)
    inflow_ = std::sqrt(air.thrust_coefficient * kAirDensity_kg_m3) * 2.0 * radius_m_ / air.advance_ratio;
  if (air.sag > 0) {
    Random random(seed, Stream("gatefield.battery"));
    battery_.emplace(air, random.uniform(air.charge_low, air.charge_high));
    battery_factor_ = battery_->factor(1.0);
  }
}

PlainVector4 Aerodynamics::thrust_n(const QuadrotorState& state, const Eigen::Vector3d& wind_W_m_s) const noexcept {
  const Eigen::Matrix3d R_WB = state.q_WB.normalized().toRotationMatrix();
  const Eigen::Vector3d v_B = R_WB.transpose() * (state.v_WB - wind_W_m_s);
  PlainVector4 given_n;
  for (std::size_t i = 0; i < kRotors; ++i) {
    const Eigen::Vector3d p_BR(model_.rotor_position_B_m[i].x(), model_.rotor_position_B_m[i].y(), 0.0);
    const auto k = static_cast<Eigen::Index>(i);
    const double static_n = battery_factor_ * std::max(state.thrust_n[k], 0.0);
    const double axial_m_s = v_B.z() + state.w_WB_B.cross(p_BR).z();
    double thrust_n = static_n - inflow_ * std::sqrt(static_n) * axial_m_s;
    thrust_n = std::clamp(thrust_n, 0.0, kMostOfStatic * static_n);
    if (ground_effect_) {
      const double height_m = std::max((state.p_WB + R_WB * p_BR).z() - floor_z_m_, radius_m_);
      const double share = radius_m_ / (4.0 * height_m);
      thrust_n /= 1.0 - share * share;
    }
    given_n[k] = thrust_n;
  }
  return given_n;
}

Eigen::Vector3d Aerodynamics::drag_W(const QuadrotorState& state, const Eigen::Vector3d& wind_W_m_s) const noexcept {
  const Eigen::Quaterniond q_WB = state.q_WB.normalized();
  const Eigen::Vector3d v_B = q_WB.conjugate() * (state.v_WB - wind_W_m_s);
  return q_WB * (-v_B.norm() * drag_kg_m_.cwiseProduct(v_B));
}

double Aerodynamics::setting_n(double thrust_n) const noexcept { return thrust_n / battery_factor_; }

void Aerodynamics::pass(const PlainVector4& thrust_n, double dt_s) noexcept {
  if (!battery_) return;
  const double hover_n = model_.mass_kg * kGravity_m_s2 / kRotors;
  double power = 0.0;
  for (int i = 0; i < kRotors; ++i)
    power += std::pow(battery_factor_ * std::max(thrust_n[i], 0.0) / hover_n, 1.5) / kRotors;
  battery_->spend(power, dt_s);
  battery_factor_ = battery_->factor(power);
}

}  // namespace gatefield::simulator
