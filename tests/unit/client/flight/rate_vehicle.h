#pragma once

#include <algorithm>
#include <cmath>

#include "common/vehicle/actuation.h"
#include "common/vehicle/quadrotor.h"
#include "gatefield/sdk/client.h"

namespace gatefield::flight {

/// A vehicle behind a rate loop that stands on the ground z = 0: thrust and body rates follow what is asked with a
/// first-order lag each.
struct RateVehicle {
  QuadrotorModel model;
  double thrust_lag_s = 0.03, rate_lag_s = 0.042;
  double thrust_factor = 1.0;  ///< true thrust over what was asked for
  QuadrotorState state;
  double thrust_n = 0.0;
  double hardest_touch_m_s = 0.0;  ///< sinking, when it met the ground

  /// Its lags, as a session tells them.
  static Actuation actuation() {
    Actuation actuation;
    actuation.kind = Actuation::Kind::kBodyRates;
    actuation.thrust_time_constant_s = RateVehicle().thrust_lag_s;
    actuation.rate_time_constant_s.setConstant(RateVehicle().rate_lag_s);
    return actuation;
  }
  bool on_ground() const { return state.p_WB.z() <= 1e-9; }
  double tilt_rad() const { return std::acos(std::clamp(state.q_WB.toRotationMatrix()(2, 2), -1.0, 1.0)); }
  void hover_at(const Eigen::Vector3d& p_W) {
    state = QuadrotorState{};
    state.p_WB = p_W;
    thrust_n = model.mass_kg * kGravity_m_s2;
  }

  /// Accelerometer along z of B.
  double specific_force_z() const {
    if (on_ground() && thrust_n < model.mass_kg * kGravity_m_s2) return kGravity_m_s2;
    return thrust_n / model.mass_kg - model.drag_kg_s.z() * (state.q_WB.conjugate() * state.v_WB).z() / model.mass_kg;
  }

  void step(double collective_n, const Eigen::Vector3d& rates_B, double dt_s) {
    const double most_n = kRotors * model.thrust_max_n;
    thrust_n +=
        (1 - std::exp(-dt_s / thrust_lag_s)) * (std::clamp(thrust_factor * collective_n, 0.0, most_n) - thrust_n);
    state.w_WB_B += (1 - std::exp(-dt_s / rate_lag_s)) * (rates_B - state.w_WB_B);
    if (const double turn = state.w_WB_B.norm() * dt_s; turn > 0)
      state.q_WB = (state.q_WB * Eigen::Quaterniond(Eigen::AngleAxisd(turn, state.w_WB_B.normalized()))).normalized();
    const Eigen::Matrix3d R = state.q_WB.toRotationMatrix();
    const Eigen::Vector3d drag_W = R * model.drag_kg_s.cwiseProduct(R.transpose() * state.v_WB);
    const Eigen::Vector3d a_W = (thrust_n * R.col(2) - drag_W) / model.mass_kg - Eigen::Vector3d(0, 0, kGravity_m_s2);
    state.p_WB += dt_s * (state.v_WB + dt_s / 2 * a_W);
    state.v_WB += dt_s * a_W;
    if (state.p_WB.z() > 0) return;
    hardest_touch_m_s = std::max(hardest_touch_m_s, -state.v_WB.z());
    state.p_WB.z() = 0;
    state.v_WB.setZero();
    state.w_WB_B.setZero();
    state.q_WB.setIdentity();
  }
};

}  // namespace gatefield::flight
