#include "server/pilot/state_history.h"

#include <gtest/gtest.h>

#include <cmath>

namespace gatefield::pilot {
namespace {

using namespace std::chrono_literals;

/// A vehicle on a circle of 6 m at 10 m/s, nose along its path: what it does between samples is known.
QuadrotorState on_circle(Stamp stamp) {
  const double rate_rad_s = 10.0 / 6.0;
  const double angle_rad = rate_rad_s * seconds(stamp);
  QuadrotorState state;
  state.p_WB = {6.0 * std::cos(angle_rad), 6.0 * std::sin(angle_rad), 1.5};
  state.v_WB = {-10.0 * std::sin(angle_rad), 10.0 * std::cos(angle_rad), 0.0};
  state.q_WB = Eigen::AngleAxisd(angle_rad + 1.5707963, Eigen::Vector3d::UnitZ());
  state.w_WB_B = {0, 0, rate_rad_s};
  return state;
}

double angle_between(const Eigen::Isometry3d& X, const QuadrotorState& state) {
  return Eigen::Quaterniond(X.linear()).angularDistance(state.q_WB);
}

TEST(StateHistory, InterpolatesBetweenStatesToAMillimetre) {
  StateHistory history;
  for (int i = 0; i < 20; ++i) history.add(i * 10ms, on_circle(i * 10ms));
  for (const Stamp stamp : {Stamp{3ms}, Stamp{10ms}, Stamp{77500us}, Stamp{189ms}}) {
    Eigen::Isometry3d X_WB;
    ASSERT_EQ(history.pose_at(stamp, &X_WB), StateHistory::Found::kYes);
    EXPECT_LT((X_WB.translation() - on_circle(stamp).p_WB).norm(), 1e-5);
    EXPECT_LT(angle_between(X_WB, on_circle(stamp)), 1e-6);
  }
}

TEST(StateHistory, BridgesLostStatesByVelocity) {
  StateHistory history;
  history.add(0ms, on_circle(0ms));
  history.add(100ms, on_circle(100ms));
  Eigen::Isometry3d X_WB;
  ASSERT_EQ(history.pose_at(50ms, &X_WB), StateHistory::Found::kYes);
  // A straight line between the two would be off by 21 mm.
  EXPECT_LT((X_WB.translation() - on_circle(50ms).p_WB).norm(), 1e-3);
}

TEST(StateHistory, GoesOnWithVelocityAndRatesForALittle) {
  StateHistory history;
  history.add(0ms, on_circle(0ms));
  Eigen::Isometry3d X_WB;
  ASSERT_EQ(history.pose_at(30ms, &X_WB), StateHistory::Found::kYes);
  EXPECT_LT((X_WB.translation() - on_circle(30ms).p_WB).norm(), 0.5 * (100.0 / 6.0) * 0.03 * 0.03 + 1e-4);
  EXPECT_LT(angle_between(X_WB, on_circle(30ms)), 1e-9);
}

TEST(StateHistory, RefusesWhatItCantKnow) {
  StateHistory history(4);
  Eigen::Isometry3d X_WB;
  std::chrono::nanoseconds off{0};
  EXPECT_EQ(history.pose_at(0ms, &X_WB), StateHistory::Found::kEmpty);

  for (int i = 0; i < 10; ++i) history.add(i * 10ms, on_circle(i * 10ms));  // keeps 60 to 90 ms
  EXPECT_EQ(history.pose_at(60ms, &X_WB), StateHistory::Found::kYes);
  EXPECT_EQ(history.pose_at(59ms, &X_WB, &off), StateHistory::Found::kTooOld);
  EXPECT_EQ(off, 1ms);
  EXPECT_EQ(history.pose_at(121ms, &X_WB, &off), StateHistory::Found::kTooNew);
  EXPECT_EQ(off, 31ms);

  history.add(400ms, on_circle(400ms));
  EXPECT_EQ(history.pose_at(200ms, &X_WB, &off), StateHistory::Found::kGap);
  EXPECT_EQ(off, 310ms);
}

}  // namespace
}  // namespace gatefield::pilot
