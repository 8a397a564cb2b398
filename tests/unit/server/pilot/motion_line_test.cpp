#include "server/pilot/motion_line.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "common/base/random.h"

namespace gatefield::pilot {
namespace {

using Verdict = MotionLine::Verdict;
using namespace std::chrono_literals;

/// A turn at 9 m/s, banked, at so many states a second.
class Motion : public ::testing::TestWithParam<int> {
 protected:
  Stamp period() const { return Stamp(1s) / GetParam(); }
  QuadrotorState at(int i) const {
    const double t_s = seconds(i * period()), rate_rad_s = 1.8, radius_m = 5.0;
    QuadrotorState state;
    state.p_WB = {radius_m * std::cos(rate_rad_s * t_s), radius_m * std::sin(rate_rad_s * t_s), 1.5};
    state.v_WB = {-rate_rad_s * state.p_WB.y(), rate_rad_s * state.p_WB.x(), 0.0};
    state.q_WB = Eigen::AngleAxisd(rate_rad_s * t_s, Eigen::Vector3d::UnitZ()) *
                 Eigen::AngleAxisd(-1.0, Eigen::Vector3d::UnitX());
    state.w_WB_B = state.q_WB.conjugate() * Eigen::Vector3d(0, 0, rate_rad_s);
    return state;
  }
  MotionLine::Judgement judge(int i, const QuadrotorState& state) {
    return line_.judge(10s + i * period(), 500s + i * period(), state, false);
  }
  Verdict verdict(int i) { return judge(i, at(i)).verdict; }

  MotionLine line_;
};

TEST_P(Motion, OfAnEstimatorWithNoiseAndCorrectionsGoesOn) {
  Random random(3, 8);
  const auto error = [&](double sigma) {
    return Eigen::Vector3d(sigma * random.normal(), sigma * random.normal(), sigma * random.normal());
  };
  Eigen::Vector3d offset_m = Eigen::Vector3d::Zero();
  for (int i = 0; i < 5 * GetParam(); ++i) {
    if (i % GetParam() == GetParam() - 1) offset_m += error(0.1);  // a correction
    QuadrotorState state = at(i);
    state.p_WB += offset_m + error(0.03);
    state.v_WB += error(0.2);
    state.w_WB_B += error(0.2);
    const Eigen::Vector3d turn = error(0.02);
    state.q_WB = Eigen::AngleAxisd(turn.norm(), turn.normalized()) * state.q_WB;
    if (i % 3 == 1) state.q_WB.coeffs() *= -1.0;
    ASSERT_EQ(judge(i, state).verdict, Verdict::kNext) << i;
  }
  EXPECT_EQ(line_.jumps(), 0u);
}

TEST_P(Motion, OfStatesInTheWrongFrameOrUnitGoesOnForOthersToName) {
  for (int i = 0; i < 3 * GetParam(); ++i) {
    QuadrotorState state = at(i);
    state.v_WB = -state.v_WB;
    state.w_WB_B = 57.3 * Eigen::Vector3d(state.w_WB_B.x(), -state.w_WB_B.y(), -state.w_WB_B.z());
    state.q_WB.coeffs() = Eigen::Vector4d(state.q_WB.w(), state.q_WB.x(), state.q_WB.y(), state.q_WB.z());
    ASSERT_EQ(judge(i, state).verdict, Verdict::kNext) << i;
  }
}

TEST_P(Motion, OneStateElsewhereIsLeftOutAndSaysWhatJumped) {
  for (const std::string field : {"p_WB", "v_WB", "q_WB"}) {
    line_ = {};
    for (int i = 0; i < 10; ++i) ASSERT_EQ(verdict(i), Verdict::kNext);
    QuadrotorState bad = at(10);
    if (field == "p_WB") bad.p_WB.x() += 7.0;
    if (field == "v_WB") bad.v_WB.z() = 60.0;
    if (field == "q_WB") bad.q_WB = bad.q_WB * Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitX());
    const MotionLine::Judgement judgement = judge(10, bad);
    EXPECT_EQ(judgement.verdict, Verdict::kOff);
    EXPECT_EQ(judgement.field, field);
    EXPECT_EQ(verdict(11), Verdict::kNext);
  }
}

TEST_P(Motion, IsTakenUpElsewhereAfterThreeThatAgree) {
  for (int i = 0; i < 10; ++i) ASSERT_EQ(verdict(i), Verdict::kNext);
  const auto moved = [&](int i) {
    QuadrotorState state = at(i);
    state.p_WB.x() += 7.0;
    return judge(i, state).verdict;
  };
  EXPECT_EQ(moved(10), Verdict::kOff);
  EXPECT_EQ(moved(11), Verdict::kOff);
  EXPECT_EQ(verdict(12), Verdict::kNext) << "back again: they don't count any more";
  EXPECT_EQ(moved(13), Verdict::kOff);
  EXPECT_EQ(moved(14), Verdict::kOff);
  EXPECT_EQ(moved(15), Verdict::kNewLine);
  EXPECT_EQ(moved(16), Verdict::kNext);
  EXPECT_EQ(line_.jumps(), 1u);
}

TEST_P(Motion, StatesHereAndThereDontAgreeWithEachOther) {
  for (int i = 0; i < 10; ++i) ASSERT_EQ(verdict(i), Verdict::kNext);
  for (int i = 10; i < 20; ++i) {
    QuadrotorState state = at(i);
    state.p_WB.z() += i % 2 == 0 ? 20.0 : -20.0;
    EXPECT_EQ(judge(i, state).verdict, Verdict::kOff) << i;
  }
}

TEST_P(Motion, TheSameStateAgainIsNoSecondWitness) {
  for (int i = 0; i < 10; ++i) ASSERT_EQ(verdict(i), Verdict::kNext);
  QuadrotorState bad = at(10);
  bad.p_WB.x() += 7.0;
  for (int attempt = 0; attempt < 5; ++attempt) EXPECT_EQ(judge(10, bad).verdict, Verdict::kOff);
  EXPECT_EQ(verdict(11), Verdict::kNext);
}

TEST_P(Motion, AStampFarAheadMakesNoRoomForAPositionFarAhead) {
  for (const bool free : {false, true}) {
    line_ = {};
    for (int i = 0; i < 10; ++i) ASSERT_EQ(line_.judge(10s + i * period(), 500s, at(i), free).verdict, Verdict::kNext);
    QuadrotorState bad = at(9);
    bad.p_WB += Eigen::Vector3d(0, 0, 15);
    EXPECT_EQ(line_.judge(10s + 9 * period() + 900ms, 500s, bad, free).verdict, Verdict::kOff);
  }
}

INSTANTIATE_TEST_SUITE_P(Rates, Motion, ::testing::Values(50, 200, 1000),
                         [](const auto& rate) { return "At" + std::to_string(rate.param) + "Hz"; });

TEST(MotionLine, AVehicleThatMovedOnWhileNothingCameGoesOn) {
  MotionLine line;
  QuadrotorState state;
  state.v_WB = {8, 0, 0};
  EXPECT_EQ(line.judge(10s, 500s, state, false).verdict, Verdict::kNext);
  state.p_WB = {14, 2, 1};
  state.v_WB = {2, 5, 0};
  EXPECT_EQ(line.judge(13s, 503s, state, false).verdict, Verdict::kNext);
}

TEST(MotionLine, BeginsAnewAnywhere) {
  MotionLine line;
  QuadrotorState state;
  line.judge(10s, 500s, state, false);
  line.begin_anew();
  state.p_WB = {90, 0, 0};
  EXPECT_EQ(line.judge(1s, 501s, state, false).verdict, Verdict::kNext);
  EXPECT_EQ(line.jumps(), 0u);
}

}  // namespace
}  // namespace gatefield::pilot
