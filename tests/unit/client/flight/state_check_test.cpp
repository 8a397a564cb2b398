#include "client/flight/state_check.h"

#include <gtest/gtest.h>

#include <limits>

namespace gatefield::flight {
namespace {

using namespace std::chrono_literals;

/// States every 10 ms along a straight line, as told or otherwise.
class StateChecked : public testing::Test {
 protected:
  void step(Stamp age = 0ms) {
    now += 10ms;
    told.state.p_WB += 0.01 * told.state.v_WB;
    told.stamp = now - age;
    check.take(now, told);
    check.pass(now);
  }
  void steps(int count) {
    for (int i = 0; i < count; ++i) step();
  }
  void silence(Stamp span) {
    now += span;
    check.pass(now);
  }

  StateCheck check{StateCheckOptions{}};
  Stamp now = 50s;
  TimedState told{.stamp = now, .state = {.v_WB = {5, 0, 0}}};
};

TEST_F(StateChecked, GoodStatesAreFreshAndSettle) {
  EXPECT_FALSE(check.fresh());
  steps(1);
  EXPECT_TRUE(check.fresh());
  EXPECT_FALSE(check.settled(now, 200ms));
  steps(20);
  EXPECT_TRUE(check.settled(now, 200ms));
  EXPECT_EQ(check.refused(), 0u);
}

TEST_F(StateChecked, SilenceIsALossAndSettlingBeginsAnew) {
  steps(50);
  silence(150ms);
  EXPECT_TRUE(check.fresh());
  silence(10ms);
  EXPECT_FALSE(check.fresh());
  EXPECT_TRUE(check.newest().has_value());
  steps(10);
  EXPECT_TRUE(check.fresh());
  EXPECT_FALSE(check.settled(now, 200ms));
}

TEST_F(StateChecked, TheSameStateAgainKeepsNothingFresh) {
  steps(50);
  for (int i = 0; i < 20; ++i) {
    now += 10ms;
    check.take(now, told);
    check.pass(now);
  }
  EXPECT_FALSE(check.fresh());
}

TEST_F(StateChecked, AJumpCostsOneState) {
  steps(50);
  told.state.p_WB.y() += 1.0;
  step();
  EXPECT_EQ(check.refused(), 1u);
  EXPECT_TRUE(check.fresh());
  EXPECT_FALSE(check.settled(now, 0ms));
  EXPECT_NEAR(check.newest()->state.p_WB.y(), 0.0, 1e-9);
  step();
  EXPECT_EQ(check.refused(), 1u);
  EXPECT_NEAR(check.newest()->state.p_WB.y(), 1.0, 1e-9);
}

TEST_F(StateChecked, ASourceThatKeepsJumpingHasNoStates) {
  steps(50);
  for (int i = 0; i < 20; ++i) {
    told.state.p_WB.y() += i % 2 ? 1.0 : -1.0;
    step();
  }
  EXPECT_FALSE(check.fresh());
}

TEST_F(StateChecked, JumpsOfVelocityAndAttitudeAreSeen) {
  steps(10);
  told.state.v_WB.x() = 9;
  step();
  EXPECT_EQ(check.refused(), 1u);
  steps(10);
  told.state.q_WB = Eigen::AngleAxisd(0.6, Eigen::Vector3d::UnitX());
  step();
  EXPECT_EQ(check.refused(), 2u);
  told.state.w_WB_B = {100, 0, 0};  // as fast as that it may turn
  steps(1);
  told.state.q_WB = Eigen::AngleAxisd(1.6, Eigen::Vector3d::UnitX());
  step();
  EXPECT_EQ(check.refused(), 2u);
}

TEST_F(StateChecked, WhatIsNotSoundIsRefused) {
  const TimedState good = told;
  const auto refuses = [&](auto change) {
    const auto before = check.refused();
    told.state = good.state;
    change(&told.state);
    step();
    EXPECT_EQ(check.refused(), before + 1);
  };
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  refuses([](QuadrotorState* s) { s->p_WB.x() = nan; });
  refuses([](QuadrotorState* s) { s->v_WB.y() = std::numeric_limits<double>::infinity(); });
  refuses([](QuadrotorState* s) { s->w_WB_B.z() = nan; });
  refuses([](QuadrotorState* s) { s->q_WB.x() = nan; });
  refuses([](QuadrotorState* s) { s->q_WB.coeffs() *= 1.1; });
}

TEST_F(StateChecked, OldStampsAndThoseOfTheFutureAreRefused) {
  step(160ms);
  EXPECT_EQ(check.refused(), 1u);
  step(-30ms);
  EXPECT_EQ(check.refused(), 2u);
}

}  // namespace
}  // namespace gatefield::flight
