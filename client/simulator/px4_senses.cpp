#include "client/simulator/px4_senses.h"

#include "client/simulator/flight_controller_in_loop.h"

namespace gatefield::simulator {
namespace {

firmware::SensorOptions seeded(firmware::SensorOptions options, std::uint64_t seed) noexcept {
  options.seed = seed;
  return options;
}

}  // namespace

Px4Senses::Px4Senses(const firmware::SensorOptions& options, std::uint64_t seed) noexcept
    : sensors_(seeded(options, seed), firmware::Site{}) {}

Px4Senses::Sample Px4Senses::take(Stamp now, const QuadrotorState& state) noexcept {
  if (before_) {
    const Eigen::Vector3d acceleration_W = (state.v_WB - before_->v_WB) / seconds(now - before_->at);
    specific_force_B_ = simulator::specific_force_B(state, acceleration_W);
  }
  before_ = {now, state.v_WB};
  const firmware::Motion motion{state.p_WB, state.v_WB, state.q_WB, state.w_WB_B, specific_force_B_};
  const auto sensor = sensors_.sample(now, motion);
  return {sensor, sensors_.satellites(now, motion), sensors_.truth(now, motion)};
}

}  // namespace gatefield::simulator
