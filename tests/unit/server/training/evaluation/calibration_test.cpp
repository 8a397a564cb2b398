#include "server/training/evaluation/calibration.h"

#include <gtest/gtest.h>

#include <cmath>

namespace gatefield::training {
namespace {

TEST(Calibrate, BinsHaveEqualNumbersInOrderOfThePrediction) {
  const auto bins = calibrate({0.4, 0.1, 0.3, 0.2, 0.5}, {4, 1, 3, 2, 5}, 2);
  ASSERT_EQ(bins.size(), 2u);
  EXPECT_EQ(bins[0].count, 2);
  EXPECT_DOUBLE_EQ(bins[0].predicted_m, 0.15);
  EXPECT_DOUBLE_EQ(bins[0].actual_m, 1.5);
  EXPECT_EQ(bins[1].count, 3);
  EXPECT_DOUBLE_EQ(bins[1].actual_m, 4.0);
  EXPECT_EQ(bins[1].actual_p10_m, 3);
  EXPECT_EQ(bins[1].actual_p90_m, 5);
}

TEST(Calibrate, FewerFramesThanBins) {
  EXPECT_EQ(calibrate({0.1, 0.2}, {1, 2}, 10).size(), 2u);
  EXPECT_TRUE(calibrate({}, {}, 10).empty());
  EXPECT_TRUE(std::isnan(calibration_error({})));
}

TEST(Calibrate, ErrorIsZeroWhenRightOnAverage) {
  EXPECT_DOUBLE_EQ(calibration_error(calibrate({1, 1, 3, 3}, {0, 2, 2, 4}, 2)), 0.0);
  EXPECT_DOUBLE_EQ(calibration_error(calibrate({1, 1, 3, 3}, {2, 2, 3, 3}, 2)), 0.5);
}

TEST(RiskCoverage, GivesUpTheWorstPredictedFirst) {
  // The worst frame (9) is predicted worst but one.
  const auto risk = risk_coverage({0.1, 0.2, 0.3, 0.4}, {1, 2, 9, 4}, 4);
  ASSERT_EQ(risk.size(), 4u);
  EXPECT_DOUBLE_EQ(risk[0].mean_m, 1.0);
  EXPECT_DOUBLE_EQ(risk[1].mean_m, 1.5);
  EXPECT_DOUBLE_EQ(risk[1].threshold_m, 0.2);
  EXPECT_DOUBLE_EQ(risk[2].mean_m, 4.0);
  EXPECT_DOUBLE_EQ(risk[2].best_m, 7.0 / 3.0);
  EXPECT_DOUBLE_EQ(risk[3].mean_m, risk[3].best_m);
  EXPECT_DOUBLE_EQ(risk[3].coverage, 1.0);
}

}  // namespace
}  // namespace gatefield::training
