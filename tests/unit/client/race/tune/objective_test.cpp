#include "client/race/tune/objective.h"

#include <gtest/gtest.h>

#include <limits>

#include "tests/unit/client/race/fixtures.h"

namespace gatefield::race {
namespace {

class Objective : public testing::Test {
 protected:
  Objective() : cell_(campaign_.cells.front()) {
    result_.cell = "a";
    result_.speed_m_s = 6;
    result_.gates_total = 4;
    result_.gates_passed = 4;
    result_.clearance_m = 0.1;
    result_.time_s = 6.0;
  }
  TrialResult lost(int passed, const Eigen::Vector3d& end_W) const {
    TrialResult out = result_;
    out.failure = Failure::kTargetGate;
    out.gates_passed = passed;
    out.end_p_W = end_W;
    return out;
  }
  Eigen::Vector3d gate_W(std::size_t i) const { return cell_.scenario.track.course.waypoints[i].p_W; }

  Campaign campaign_ = campaign_of(kTwoCells);
  const Cell& cell_;
  TrialResult result_;
};

TEST_F(Objective, AnyRaceThatIsWonIsWorthTwiceAnyThatIsLost) {
  result_.clearance_m = 0.0;
  result_.time_s = 1e6;
  EXPECT_GE(score(cell_, result_), 1.0);
  EXPECT_LE(score(cell_, lost(3, gate_W(3))), 0.5) << "lost in the last gate";
}

TEST_F(Objective, ALostRaceIsWorthWhatWasFlown) {
  EXPECT_DOUBLE_EQ(score(cell_, lost(0, cell_.scenario.track.start_p_WB)), 0.0);
  EXPECT_DOUBLE_EQ(score(cell_, lost(2, gate_W(1))), 0.25);
  EXPECT_NEAR(score(cell_, lost(2, 0.5 * (gate_W(1) + gate_W(2)))), 0.3125, 1e-9) << "half-way to the third";
  EXPECT_LT(score(cell_, lost(1, gate_W(0))), score(cell_, lost(1, 0.9 * gate_W(0) + 0.1 * gate_W(1))));
  EXPECT_DOUBLE_EQ(score(cell_, lost(2, gate_W(2) + Eigen::Vector3d(0, 0, 1e3))), 0.25) << "away is no way";
  TrialResult nowhere = lost(1, Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN()));
  EXPECT_DOUBLE_EQ(score(cell_, nowhere), 0.125);
}

TEST_F(Objective, ClearanceCountsUntilThereIsPlenty) {
  // 0.5 m of half-width, a hull of 0.13 m: 0.37 m at most, 0.185 m are plenty.
  const auto at = [this](double clearance_m) {
    result_.clearance_m = clearance_m;
    return score(cell_, result_);
  };
  EXPECT_NEAR(at(0.0925) - at(0.0), 0.15, 1e-9);
  EXPECT_NEAR(at(0.185) - at(0.0), 0.3, 1e-9);
  EXPECT_DOUBLE_EQ(at(0.3), at(0.185));
  EXPECT_DOUBLE_EQ(at(std::numeric_limits<double>::quiet_NaN()), at(0.3)) << "never near a frame";
}

TEST_F(Objective, TimeCountsUntilTheNominalCourseAtTheLimit) {
  const double soonest_s = course_length_m(cell_) / 6.0;
  const auto at = [this](double time_s) {
    result_.time_s = time_s;
    return score(cell_, result_);
  };
  EXPECT_NEAR(at(soonest_s) - at(2 * soonest_s), 0.1, 1e-9);
  EXPECT_DOUBLE_EQ(at(0.5 * soonest_s), at(soonest_s)) << "faster than the limit gains nothing";
}

TEST_F(Objective, LengthIsOfAllLapsFromTheStart) {
  Campaign two = campaign_of(kTwoCells);
  const double lap_m = course_length_m(two.cells[0]);
  two.cells[0].scenario.track.course.laps = 2;
  const double way_in_m = (gate_W(0) - cell_.scenario.track.start_p_WB).norm();
  const double around_m = (gate_W(3) - gate_W(0)).norm();
  EXPECT_NEAR(course_length_m(two.cells[0]), 2 * lap_m - way_in_m + around_m, 1e-9);
}

TEST_F(Objective, AProfileIsItsMeanAndTheMediansOfWhatItWon) {
  TrialResult other = result_;
  other.clearance_m = 0.2;
  other.time_s = 8.0;
  const TrialResult third = lost(0, cell_.scenario.track.start_p_WB);
  const Score all = summarize_scores(campaign_, {result_, other, third});
  EXPECT_EQ(all.trials, 3u);
  EXPECT_EQ(all.won, 2u);
  EXPECT_DOUBLE_EQ(all.mean, (score(cell_, result_) + score(cell_, other)) / 3);
  EXPECT_DOUBLE_EQ(all.clearance_m, 0.15);
  EXPECT_DOUBLE_EQ(all.time_s, 7.0);
}

TEST(SignTest, IsTheBinomialsTwoTails) {
  EXPECT_DOUBLE_EQ(sign_test(0, 0), 1.0);
  EXPECT_NEAR(sign_test(5, 0), 2.0 / 32, 1e-12);
  EXPECT_NEAR(sign_test(0, 6), 2.0 / 64, 1e-12);
  EXPECT_NEAR(sign_test(8, 2), 2.0 * (1 + 10 + 45) / 1024, 1e-12);
  EXPECT_DOUBLE_EQ(sign_test(4, 4), 1.0);
}

}  // namespace
}  // namespace gatefield::race
