#include "server/kernels/rollout/rates.h"

#include <cmath>
#include <limits>

#include "common/base/random.h"
#include "tests/unit/server/kernels/every_backend.h"

namespace gatefield::kernels {
namespace {

constexpr double kDt_s = 0.03;
constexpr int kSteps = 20;

class RatesTest : public EveryBackend {};

RateRollout racer(RateInputs inputs) {
  RateRollout how;
  how.actuation.kind = Actuation::Kind::kBodyRates;
  how.actuation.thrust_time_constant_s = 0.025;
  how.actuation.rate_time_constant_s = {0.04, 0.05, 0.12};
  how.inputs = inputs;
  how.thrust_factor = 1.1;
  how.low = {4.0, -9.0, -9.0, -6.0};
  how.high = {32.0, 9.0, 9.0, 6.0};
  return how;
}

const RateCommand kAsked{9.0, 1.0, -2.0, 0.5};

QuadrotorState racing_state() {
  QuadrotorState start;
  start.p_WB = {-4.0, 2.5, 1.5};
  start.v_WB = {6.0, -3.0, 0.5};
  start.q_WB = Eigen::Quaterniond(Eigen::AngleAxisd(0.7, Eigen::Vector3d(0.3, -0.8, 0.5).normalized()));
  start.w_WB_B = {2.0, -3.0, 1.0};
  start.thrust_n.setConstant(2.2);
  return start;
}

/// Commands around hover, or changes of about that much in a few steps.
void fill_inputs(OwnedBlock& inputs, RateInputs kind, std::uint64_t seed) {
  Random random(seed);
  const SampleBlock block = inputs.block();
  const double scale = kind == RateInputs::kCommands ? 1.0 : 10.0;
  for (int k = 0; k < block.steps; ++k) {
    for (int i = 0; i < block.channels; ++i) {
      const double middle = i == 0 && kind == RateInputs::kCommands ? 10.0 : 0.0;
      for (int m = 0; m < padded_samples(block.samples); ++m)
        inputs.at(k, i, m) = static_cast<float>(middle + scale * (i == 0 ? 8.0 : 5.0) * random.normal());
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

TEST_P(RatesTest, FollowsTheReferenceForEveryNumberOfSamples) {
  for (const RateInputs kind : {RateInputs::kCommands, RateInputs::kChanges}) {
    for (int samples = 1; samples <= 67; ++samples) {
      OwnedBlock inputs(kSteps, kInputs, samples), states(kSteps, kStateChannels, samples);
      fill_inputs(inputs, kind, 7);
      OwnedBlock expected_inputs(kSteps, kInputs, samples), expected(kSteps, kStateChannels, samples);
      fill_inputs(expected_inputs, kind, 7);

      backend().rollout_rates(racer(kind), racing_state(), kAsked, kDt_s, inputs.block(), states.block());
      rollout_rates_reference(racer(kind), racing_state(), kAsked, kDt_s, expected_inputs.block(), expected.block());

      ASSERT_TRUE(inputs.guards_hold() && states.guards_hold()) << samples << " samples";
      for (int k = 0; k < kSteps; ++k) {
        for (int m = 0; m < samples; ++m) {
          for (int channel = 0; channel < kStateChannels; ++channel) {
            ASSERT_NEAR(states.at(k, channel, m), expected.at(k, channel, m), tolerance(channel))
                << "channel " << channel << ", step " << k << ", sample " << m << " of " << samples;
          }
          for (int i = 0; i < kInputs; ++i) ASSERT_NEAR(inputs.at(k, i, m), expected_inputs.at(k, i, m), 5e-3);
        }
      }
    }
  }
}

TEST_P(RatesTest, SaysWhatWasAppliedWithinTheLimits) {
  OwnedBlock inputs(1, kInputs, 1), states(1, kStateChannels, 1);
  inputs.at(0, 0, 0) = 100.0f;
  inputs.at(0, 1, 0) = -20.0f;
  inputs.at(0, 2, 0) = std::nanf("");
  inputs.at(0, 3, 0) = 2.0f;
  backend().rollout_rates(racer(RateInputs::kCommands), racing_state(), kAsked, kDt_s, inputs.block(), states.block());
  EXPECT_EQ(inputs.at(0, 0, 0), 32.0f);
  EXPECT_EQ(inputs.at(0, 1, 0), -9.0f);
  EXPECT_EQ(inputs.at(0, 2, 0), -2.0f);  // as before
  EXPECT_EQ(inputs.at(0, 3, 0), 2.0f);

  inputs.at(0, 0, 0) = 1e4f;
  inputs.at(0, 1, 0) = -1e4f;
  inputs.at(0, 2, 0) = std::nanf("");
  inputs.at(0, 3, 0) = 20.0f;
  backend().rollout_rates(racer(RateInputs::kChanges), racing_state(), kAsked, kDt_s, inputs.block(), states.block());
  EXPECT_NEAR(inputs.at(0, 0, 0), (32.0 - 9.0) / kDt_s, 1e-2);
  EXPECT_NEAR(inputs.at(0, 1, 0), (-9.0 - 1.0) / kDt_s, 1e-2);
  EXPECT_EQ(inputs.at(0, 2, 0), 0.0f);
  EXPECT_NEAR(inputs.at(0, 3, 0), 20.0, 1e-3);
}

TEST_P(RatesTest, HoversOnTheSpotWithTheThrustThatTheFactorLeaves) {
  RateRollout how = racer(RateInputs::kCommands);
  const double weight_n = how.model.mass_kg * kGravity_m_s2;
  QuadrotorState start;
  start.p_WB = {1, 2, 3};
  start.thrust_n.setConstant(weight_n / how.thrust_factor / kRotors);
  OwnedBlock inputs(kSteps, kInputs, 5), states(kSteps, kStateChannels, 5);
  for (int k = 0; k < kSteps; ++k) {
    for (int m = 0; m < padded_samples(5); ++m) inputs.at(k, 0, m) = static_cast<float>(weight_n / how.thrust_factor);
  }
  backend().rollout_rates(how, start, hover_command(how.model), kDt_s, inputs.block(), states.block());
  for (int m = 0; m < 5; ++m) {
    EXPECT_NEAR(states.at(kSteps - 1, kPx, m), 1, 1e-5);
    EXPECT_NEAR(states.at(kSteps - 1, kPz, m), 3, 1e-5);
    EXPECT_NEAR(states.at(kSteps - 1, kThrustSum, m), weight_n / how.thrust_factor, 1e-4);
  }
}

TEST_P(RatesTest, StaysFiniteWhateverTheInputsAre) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  const float values[] = {kInfinity, -kInfinity, std::nanf(""), 3e38f, -3e38f, 1e-45f, 0.0f, 1e6f, -1e6f};
  QuadrotorState wild = racing_state();
  wild.p_WB = {1e300, std::nan(""), -HUGE_VAL};
  wild.v_WB = {HUGE_VAL, -1e30, std::nan("")};
  wild.q_WB.coeffs() = {0, 0, 0, std::nan("")};
  wild.w_WB_B = {1e20, -1e20, HUGE_VAL};
  wild.thrust_n = {std::nan(""), 1e300, -1e300, HUGE_VAL};
  const RateCommand nowhere{std::nan(""), HUGE_VAL, -1e300, 0.0};
  for (const RateInputs kind : {RateInputs::kCommands, RateInputs::kChanges}) {
    for (const double dt_s : {0.001, 0.03, 0.2}) {
      OwnedBlock inputs(60, kInputs, 67), states(60, kStateChannels, 67);
      Random random(11);
      for (int k = 0; k < 60; ++k) {
        for (int i = 0; i < kInputs; ++i) {
          for (int m = 0; m < padded_samples(67); ++m) inputs.at(k, i, m) = values[random.below(9)];
        }
      }
      backend().rollout_rates(racer(kind), wild, nowhere, dt_s, inputs.block(), states.block());
      for (int k = 0; k < 60; ++k) {
        for (int m = 0; m < padded_samples(67); ++m) {
          for (int c = 0; c < kStateChannels; ++c)
            ASSERT_TRUE(std::isfinite(states.at(k, c, m))) << c << " " << k << " " << m;
          for (int i = 0; i < kInputs; ++i) ASSERT_TRUE(std::isfinite(inputs.at(k, i, m)));
        }
      }
    }
  }
}

ON_EVERY_BACKEND(RatesTest);

}  // namespace
}  // namespace gatefield::kernels
