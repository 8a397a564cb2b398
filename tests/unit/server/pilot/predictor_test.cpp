#include "server/pilot/predictor.h"

#include <gtest/gtest.h>

#include <vector>

namespace gatefield::pilot {
namespace {

using namespace std::chrono_literals;

TEST(Predictor, FollowsTheCommandsThatWereSent) {
  // The vehicle flies two plans; the prediction from a state in the first must end where the vehicle does.
  const QuadrotorModel model;
  QuadrotorState start;
  start.p_WB = {1, 2, 3};
  start.v_WB = {6, 1, 0};
  start.q_WB = Eigen::AngleAxisd(0.3, Eigen::Vector3d(0.2, 1, 0).normalized());
  start.w_WB_B = {0.5, 1.0, -0.3};
  start.thrust_n = start.thrust_command_n = hover_thrust_n(model);

  std::vector<ThrustRates> first(20, ThrustRates(10, -8, 5, 0));
  std::vector<ThrustRates> second(20, ThrustRates(-12, 9, 3, 6));
  InputTimeline inputs;
  inputs.add(0ms, 30ms, first, 400ms);
  inputs.add(45ms, 30ms, second, 400ms);

  QuadrotorState truth = start;
  for (int ms = 0; ms < 100; ++ms) truth = step_reference(model, truth, ms < 45 ? first[0] : second[0], 1e-3);
  QuadrotorState predicted = start;
  predict({.model = model}, inputs, 0ms, 100ms, Eigen::Vector3d::Zero(), &predicted);
  EXPECT_LT((predicted.p_WB - truth.p_WB).norm(), 1e-5);
  EXPECT_LT((predicted.v_WB - truth.v_WB).norm(), 1e-4);
  EXPECT_LT(predicted.q_WB.angularDistance(truth.q_WB), 1e-5);
  EXPECT_LT((predicted.thrust_n - truth.thrust_n).norm(), 1e-6);
  EXPECT_LT((predicted.thrust_command_n - truth.thrust_command_n).norm(), 1e-9);

  // Without the commands it would be elsewhere: the test can tell.
  QuadrotorState blind = start;
  predict({.model = model}, InputTimeline{}, 0ms, 100ms, Eigen::Vector3d::Zero(), &blind);
  EXPECT_GT((blind.p_WB - truth.p_WB).norm(), 5e-4);
  EXPECT_GT(blind.q_WB.angularDistance(truth.q_WB), 5e-3);
}

TEST(Predictor, AddsTheDisturbance) {
  const QuadrotorModel model;
  QuadrotorState state;
  state.thrust_n = state.thrust_command_n = hover_thrust_n(model);
  predict({.model = model}, InputTimeline{}, 0ms, 200ms, {1.0, 0, -0.5}, &state);
  EXPECT_NEAR(state.v_WB.x(), 0.2, 0.01);  // a little less: drag
  EXPECT_NEAR(state.p_WB.x(), 0.02, 1e-3);
  EXPECT_NEAR(state.p_WB.z(), -0.01, 1e-3);
}

TEST(Predictor, ReplaysWhatAFlightControllerWasAskedFor) {
  const Dynamics vehicle{.actuation = {Actuation::Kind::kBodyRates, 0.025, {0.04, 0.05, 0.1}}, .thrust_factor = 1.1};
  const RateCommand first(12.0, 3.0, -2.0, 0.5), second(6.0, -3.0, 1.0, 0.0), hover = hover_command(vehicle.model);
  InputTimeline inputs(hover);
  inputs.add(0ms, 30ms, std::vector<PlainVector4>(20, first), 400ms);
  inputs.add(45ms, 30ms, std::vector<PlainVector4>(1, second), 400ms);
  EXPECT_EQ(inputs.at(44ms), first);
  EXPECT_EQ(inputs.at(45ms), second);
  EXPECT_EQ(inputs.at(75ms), hover) << "nothing was asked for beyond the plan";
  EXPECT_TRUE(inputs.covers(0ms, 75ms));
  EXPECT_FALSE(inputs.covers(-1ms, 75ms));
  EXPECT_FALSE(inputs.covers(40ms, 76ms));

  QuadrotorState truth;
  truth.v_WB = {6, 1, 0};
  truth.thrust_n = hover_thrust_n(vehicle.model);
  QuadrotorState predicted = truth, thrust = truth;
  for (int ms = 0; ms < 100; ++ms) {
    const RateCommand& asked = ms < 45 ? first : ms < 75 ? second : hover;
    truth = step_body_rates(vehicle.model, vehicle.actuation, truth, asked, asked, 1e-3, vehicle.thrust_factor);
  }
  predict(vehicle, inputs, 0ms, 100ms, Eigen::Vector3d::Zero(), &predicted);
  predict_rotors(vehicle, inputs, 0ms, 100ms, &thrust);
  EXPECT_LT((predicted.p_WB - truth.p_WB).norm(), 1e-3);
  EXPECT_LT((predicted.v_WB - truth.v_WB).norm(), 1e-2);
  EXPECT_LT((predicted.w_WB_B - truth.w_WB_B).norm(), 1e-9);
  EXPECT_NEAR(predicted.thrust_n.sum(), truth.thrust_n.sum(), 1e-9);
  EXPECT_NEAR(thrust.thrust_n.sum(), truth.thrust_n.sum(), 1e-9);
}

TEST(Predictor, ModelsRotorsThatCantBeMeasured) {
  const QuadrotorModel model;
  InputTimeline inputs;
  inputs.add(0ms, 30ms, std::vector<ThrustRates>(20, ThrustRates(5, 5, -5, 0)), 400ms);
  QuadrotorState rotors;
  rotors.thrust_n = rotors.thrust_command_n = hover_thrust_n(model);
  QuadrotorState truth = rotors;
  for (int ms = 0; ms < 70; ++ms) step_rotors(model, ThrustRates(5, 5, -5, 0), 1e-3, &truth);
  predict_rotors({.model = model}, inputs, 0ms, 70ms, &rotors);
  EXPECT_LT((rotors.thrust_n - truth.thrust_n).norm(), 1e-9);
  EXPECT_LT((rotors.thrust_command_n - truth.thrust_command_n).norm(), 1e-9);
  EXPECT_GT((rotors.thrust_n - hover_thrust_n(model)).norm(), 0.2);
}

TEST(DelayEstimate, TakesTheServersOwnPartOutOfTheRoundTrip) {
  DelayEstimate delay;
  EXPECT_EQ(delay.ahead(), 0ns);
  for (int i = 0; i < 200; ++i) {
    delay.round_trip(28ms);
    delay.residence(8ms);
    delay.solve(5ms);
  }
  EXPECT_NEAR(seconds(delay.network()), 0.020, 1e-6);
  EXPECT_NEAR(seconds(delay.ahead()), 0.025, 1e-4);
}

TEST(DelayEstimate, StaysWithinItsBounds) {
  DelayEstimate slow;
  slow.round_trip(2s);
  slow.solve(1s);
  EXPECT_EQ(slow.ahead(), DelayEstimate::kMaxDelay);
  DelayEstimate odd;
  odd.round_trip(1ms);
  odd.residence(5ms);
  EXPECT_EQ(odd.network(), 0ns);
}

TEST(DelayEstimate, OneBrokenMeasurementIsForgottenWithinAFifthOfASecond) {
  DelayEstimate delay;
  for (int i = 0; i < 100; ++i) delay.round_trip(28ms);
  delay.round_trip(60s);                                // the longest that a state may tell
  for (int i = 0; i < 10; ++i) delay.round_trip(28ms);  // at 50 Hz
  EXPECT_LT(delay.network(), 60ms);
}

TEST(DelayEstimate, AllowsForSolveTimesThatVary) {
  DelayEstimate delay;
  for (int i = 0; i < 200; ++i) delay.solve(i % 2 ? 4ms : 8ms);
  EXPECT_GT(seconds(delay.ahead()), 0.008);
  EXPECT_LT(seconds(delay.ahead()), 0.012);
}

TEST(DelayEstimate, OfALinkThatJittersMostPlansAreNotLate) {
  DelayEstimate steady, jittery;
  int late = 0;
  for (int i = 0; i < 400; ++i) {
    const auto taken = std::chrono::milliseconds(100 + (i * 37) % 41);  // evenly spread over 40 ms
    late += i >= 50 && taken > jittery.whole() ? 1 : 0;
    jittery.round_trip(taken);
    steady.round_trip(100ms);
  }
  EXPECT_NEAR(seconds(steady.whole()), 0.100, 1e-4);
  EXPECT_LT(seconds(jittery.whole()), 0.150);
  EXPECT_LT(late, 35);
  for (int i = 0; i < 400; ++i) jittery.round_trip(2s);
  EXPECT_EQ(jittery.whole(), DelayEstimate::kMaxDelay);
}

}  // namespace
}  // namespace gatefield::pilot
