#include "server/kernels/rollout/rollout.h"

#include <cmath>
#include <limits>

#include "common/base/random.h"
#include "tests/unit/server/kernels/every_backend.h"

namespace gatefield::kernels {
namespace {

constexpr double kDt_s = 0.03;
constexpr int kSteps = 20;

class RolloutTest : public EveryBackend {};

QuadrotorState racing_state() {
  QuadrotorState start;
  start.p_WB = {-4.0, 2.5, 1.5};
  start.v_WB = {6.0, -3.0, 0.5};
  start.q_WB = Eigen::Quaterniond(Eigen::AngleAxisd(0.7, Eigen::Vector3d(0.3, -0.8, 0.5).normalized()));
  start.w_WB_B = {2.0, -3.0, 1.0};
  start.thrust_n = {2.0, 3.0, 2.5, 1.5};
  start.thrust_command_n = {2.2, 2.8, 2.6, 1.4};
  return start;
}

void fill_inputs(OwnedBlock& inputs, std::uint64_t seed, double sigma_n_s) {
  Random random(seed);
  const SampleBlock block = inputs.block();
  for (int k = 0; k < block.steps; ++k) {
    for (int i = 0; i < block.channels; ++i) {
      for (int m = 0; m < padded_samples(block.samples); ++m)
        inputs.at(k, i, m) = static_cast<float>(sigma_n_s * random.normal());
    }
  }
}

double tolerance(int channel) {
  if (channel <= kPz) return 1e-3;
  if (channel <= kVz) return 5e-3;
  if (channel <= kQz) return 1e-3;
  if (channel <= kWz) return 1e-2;
  return 1e-3;
}

TEST_P(RolloutTest, FollowsTheReferenceForEveryNumberOfSamples) {
  const QuadrotorModel model;
  for (int samples = 1; samples <= 67; ++samples) {
    OwnedBlock inputs(kSteps, kInputs, samples), expected_inputs(kSteps, kInputs, samples);
    OwnedBlock states(kSteps, kStateChannels, samples), expected(kSteps, kStateChannels, samples);
    fill_inputs(inputs, 7, 15.0);
    fill_inputs(expected_inputs, 7, 15.0);

    backend().rollout(model, racing_state(), kDt_s, inputs.block(), states.block());
    rollout_reference(model, racing_state(), kDt_s, expected_inputs.block(), expected.block());

    ASSERT_TRUE(inputs.guards_hold() && states.guards_hold()) << samples << " samples";
    for (int k = 0; k < kSteps; ++k) {
      for (int m = 0; m < samples; ++m) {
        for (int channel = 0; channel < kStateChannels; ++channel) {
          ASSERT_NEAR(states.at(k, channel, m), expected.at(k, channel, m), tolerance(channel))
              << "channel " << channel << ", step " << k << ", sample " << m << " of " << samples;
        }
        for (int i = 0; i < kInputs; ++i) ASSERT_NEAR(inputs.at(k, i, m), expected_inputs.at(k, i, m), 2e-3);
      }
    }
  }
}

TEST_P(RolloutTest, SaysWhatWasAppliedAfterTheLimits) {
  const QuadrotorModel model;
  QuadrotorState start;
  start.thrust_n = start.thrust_command_n = Eigen::Vector4d(9.9, 0.1, 5.0, 5.0);
  OwnedBlock inputs(1, kInputs, 1), states(1, kStateChannels, 1);
  inputs.at(0, 0, 0) = 20.0f;    // stops at thrust_max_n after 0.1 N
  inputs.at(0, 1, 0) = -20.0f;   // stops at thrust_min_n after 0.1 N
  inputs.at(0, 2, 0) = 1000.0f;  // stops at thrust_rate_max_n_s
  inputs.at(0, 3, 0) = 7.0f;

  backend().rollout(model, start, kDt_s, inputs.block(), states.block());

  EXPECT_NEAR(inputs.at(0, 0, 0), 0.1 / kDt_s, 1e-3);
  EXPECT_NEAR(inputs.at(0, 1, 0), -0.1 / kDt_s, 1e-3);
  EXPECT_NEAR(inputs.at(0, 2, 0), model.thrust_rate_max_n_s, 1e-3);
  EXPECT_NEAR(inputs.at(0, 3, 0), 7.0, 1e-3);
}

TEST_P(RolloutTest, HoversOnTheSpot) {
  const QuadrotorModel model;
  QuadrotorState start;
  start.p_WB = {1, 2, 3};
  start.thrust_n = start.thrust_command_n = hover_thrust_n(model);
  OwnedBlock inputs(kSteps, kInputs, 5), states(kSteps, kStateChannels, 5);
  backend().rollout(model, start, kDt_s, inputs.block(), states.block());
  for (int m = 0; m < 5; ++m) {
    EXPECT_NEAR(states.at(kSteps - 1, kPx, m), 1, 1e-5);
    EXPECT_NEAR(states.at(kSteps - 1, kPy, m), 2, 1e-5);
    EXPECT_NEAR(states.at(kSteps - 1, kPz, m), 3, 1e-5);
    EXPECT_NEAR(states.at(kSteps - 1, kThrustSum, m), model.mass_kg * kGravity_m_s2, 1e-4);
  }
}

TEST_P(RolloutTest, KeepsTheQuaternionAtUnitLength) {
  OwnedBlock inputs(200, kInputs, 33), states(200, kStateChannels, 33);
  fill_inputs(inputs, 3, 30.0);
  backend().rollout(QuadrotorModel{}, racing_state(), kDt_s, inputs.block(), states.block());
  for (int k = 0; k < 200; ++k) {
    for (int m = 0; m < 33; ++m) {
      const double norm = std::sqrt(std::pow(states.at(k, kQw, m), 2) + std::pow(states.at(k, kQx, m), 2) +
                                    std::pow(states.at(k, kQy, m), 2) + std::pow(states.at(k, kQz, m), 2));
      ASSERT_NEAR(norm, 1.0, 1e-6);
    }
  }
}

TEST_P(RolloutTest, StaysFiniteWhateverTheInputsAre) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  const float values[] = {kInfinity, -kInfinity, std::nanf(""), 3e38f, -3e38f, 1e-45f, 0.0f, 1e6f, -1e6f};
  OwnedBlock inputs(60, kInputs, 67), states(60, kStateChannels, 67);
  Random random(11);
  for (int k = 0; k < 60; ++k) {
    for (int i = 0; i < kInputs; ++i) {
      for (int m = 0; m < padded_samples(67); ++m) inputs.at(k, i, m) = values[random.below(9)];
    }
  }
  QuadrotorState wild = racing_state();
  wild.p_WB = {1e300, std::nan(""), -HUGE_VAL};
  wild.v_WB = {HUGE_VAL, -1e30, std::nan("")};
  wild.q_WB.coeffs() = {0, 0, 0, std::nan("")};
  wild.w_WB_B = {1e20, -1e20, HUGE_VAL};
  wild.thrust_n = {std::nan(""), 1e300, -1e300, HUGE_VAL};
  wild.thrust_command_n = {1e300, -HUGE_VAL, std::nan(""), -1e300};

  for (const QuadrotorState& start : {racing_state(), wild}) {
    for (const double dt_s : {0.001, 0.03, 0.5}) {
      OwnedBlock applied = inputs;
      SampleBlock block = inputs.block();
      backend().rollout(QuadrotorModel{}, start, dt_s, block, states.block());
      for (int k = 0; k < 60; ++k) {
        for (int m = 0; m < padded_samples(67); ++m) {
          for (int c = 0; c < kStateChannels; ++c)
            ASSERT_TRUE(std::isfinite(states.at(k, c, m))) << c << " " << k << " " << m;
          for (int i = 0; i < kInputs; ++i) ASSERT_TRUE(std::isfinite(inputs.at(k, i, m)));
        }
      }
      rollout_reference(QuadrotorModel{}, start, dt_s, block, states.block());
      for (int k = 0; k < 60; ++k) {
        for (int c = 0; c < kStateChannels; ++c) ASSERT_TRUE(std::isfinite(states.at(k, c, 66))) << c << " " << k;
      }
    }
  }
}

TEST_P(RolloutTest, ASampleDoesNotDependOnItsPlaceInTheBlock) {
  OwnedBlock many(kSteps, kInputs, 200), many_states(kSteps, kStateChannels, 200);
  fill_inputs(many, 5, 10.0);
  OwnedBlock one(kSteps, kInputs, 1), one_state(kSteps, kStateChannels, 1);
  for (int k = 0; k < kSteps; ++k) {
    for (int i = 0; i < kInputs; ++i) one.at(k, i, 0) = many.at(k, i, 137);
  }
  backend().rollout(QuadrotorModel{}, racing_state(), kDt_s, many.block(), many_states.block());
  backend().rollout(QuadrotorModel{}, racing_state(), kDt_s, one.block(), one_state.block());
  for (int c = 0; c < kStateChannels; ++c)
    EXPECT_EQ(one_state.at(kSteps - 1, c, 0), many_states.at(kSteps - 1, c, 137));
}

ON_EVERY_BACKEND(RolloutTest);

}  // namespace
}  // namespace gatefield::kernels
