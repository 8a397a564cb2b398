#include "client/simulator/flight_controller_in_loop.h"

#include <algorithm>

namespace gatefield::simulator {

Status check_firmware_scenario(const config::Scenario& scenario) {
  if (scenario.vehicle.actuation.kind != Actuation::Kind::kBodyRates)
    return Error::invalid("actuation", "rotor thrusts", "body rates: that is what a flight controller takes");
  const config::Mismatch& mismatch = scenario.mismatch;
  if (mismatch.rate_lag_factor != 1.0 || mismatch.setpoint_delay != Stamp{0} || !mismatch.rate_limit_rad_s.isZero(0.0))
    return Error(
        "mismatch: a rate loop's factor and limit and a setpoint's delay are of the simulator's own rate loop, "
        "expected "
        "none of them with a firmware in the loop",
        ErrorCode::kInvalid, "mismatch");
  return {};
}

Result<std::array<Corner, kRotors>> corners(const QuadrotorModel& model) {
  constexpr double kLeastSlant = 0.3;  // of the shorter side against the longer: a stretched X, but no plus
  std::array<Corner, kRotors> found{};
  std::array<int, kRotors> rotors_at{};
  for (std::size_t rotor = 0; rotor < found.size(); ++rotor) {
    const auto& arm = model.rotor_position_B_m[rotor];
    if (arm.x() > 0) {
      found[rotor] = arm.y() > 0 ? kFrontLeft : kFrontRight;
    } else {
      found[rotor] = arm.y() > 0 ? kRearLeft : kRearRight;
    }
    if (arm.cwiseAbs().minCoeff() > kLeastSlant * arm.cwiseAbs().maxCoeff()) ++rotors_at[found[rotor]];
  }
  if (std::any_of(rotors_at.begin(), rotors_at.end(), [](int count) { return count != 1; }))
    return Error::invalid("quadrotor.rotor", "of another layout", "one rotor in each corner, as the firmware's mixer");
  return found;
}

Error firmware_lost(const std::string& name, const std::string& what, const std::vector<std::string>& complaints) {
  std::string sentence = name + ": " + what;
  for (const std::string& complaint : complaints) sentence += "; " + complaint;
  return Error(sentence, ErrorCode::kNotAnswering, "flight_controller");
}

sdk::Setpoint hover_setpoint(const QuadrotorModel& model) noexcept {
  sdk::Setpoint setpoint;
  setpoint.collective_thrust_n = model.mass_kg * kGravity_m_s2;
  return setpoint;
}

Eigen::Vector3d specific_force_B(const QuadrotorState& state, const Eigen::Vector3d& acceleration_W) noexcept {
  const Eigen::Vector3d felt_W = acceleration_W + Eigen::Vector3d(0.0, 0.0, kGravity_m_s2);
  return state.q_WB.conjugate() * felt_W;
}

}  // namespace gatefield::simulator
