#pragma once

#include "../one_gate/vehicle.h"

/// The vehicle of the other example behind a flight controller: collective thrust and body rates go in, and a
/// proportional rate loop asks the rotors for thrusts anew every millisecond.
class RateControlledVehicle : public SimulatedVehicle {
 public:
  /// What a planner should reckon with: how long after a step of a body rate 63 % of it are there (about x, y, z), and
  /// the same for the thrust, which is the rotors' own lag.
  static gatefield::Actuation actuation(const gatefield::QuadrotorModel& model) {
    gatefield::Actuation actuation;
    actuation.kind = gatefield::Actuation::Kind::kBodyRates;
    actuation.thrust_time_constant_s = model.rotor_time_constant_s;
    actuation.rate_time_constant_s = Eigen::Vector3d(0.046, 0.046, 0.085);
    return actuation;
  }

  RateControlledVehicle(const gatefield::QuadrotorModel& model, const gatefield::CameraModel& camera,
                        const gatefield::GateShape& shape, const Eigen::Vector3d& p_WG, bool real_time)
      : SimulatedVehicle(model, camera, shape, p_WG, real_time),
        inertia_kg_m2_(model.inertia_kg_m2),
        collective_n_(model.mass_kg * gatefield::kGravity_m_s2) {
    Eigen::Matrix4d wrench_from_thrust;
    for (int i = 0; i < gatefield::kRotors; ++i) {
      const auto k = static_cast<std::size_t>(i);
      wrench_from_thrust.col(i) << 1.0, model.rotor_position_B_m[k].y(), -model.rotor_position_B_m[k].x(),
          model.rotor_spin[k] * model.torque_per_thrust_m;
    }
    thrust_from_wrench_ = wrench_from_thrust.inverse();
    rotors_follow([this](const gatefield::QuadrotorState& state) { return rotor_thrust_n(state); });
  }

  void command(double collective_n, const Eigen::Vector3d& body_rates_rad_s) {
    state();  // up to now what was commanded before holds
    collective_n_ = collective_n;
    body_rates_rad_s_ = body_rates_rad_s;
  }

 private:
  gatefield::PlainVector4 rotor_thrust_n(const gatefield::QuadrotorState& state) const {
    const Eigen::Vector3d gain_s(25.0, 25.0, 12.0);
    const Eigen::Vector3d torque_B = inertia_kg_m2_.cwiseProduct(gain_s.cwiseProduct(body_rates_rad_s_ - state.w_WB_B));
    return thrust_from_wrench_ * Eigen::Vector4d(collective_n_, torque_B.x(), torque_B.y(), torque_B.z());
  }

  Eigen::Vector3d inertia_kg_m2_;
  Eigen::Matrix4d thrust_from_wrench_;
  double collective_n_;
  Eigen::Vector3d body_rates_rad_s_ = Eigen::Vector3d::Zero();
};
