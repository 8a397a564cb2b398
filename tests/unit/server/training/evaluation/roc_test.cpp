#include "server/training/evaluation/roc.h"

#include <gtest/gtest.h>

#include <cmath>

namespace gatefield::training {
namespace {

TEST(Roc, PerfectScores) {
  const auto curve = roc_curve({0.9, 0.8, 0.7}, {0.1, 0.2});
  EXPECT_DOUBLE_EQ(area_under(curve), 1.0);
  EXPECT_DOUBLE_EQ(keeping(curve, 1.0).false_alarms, 0.0);
  EXPECT_DOUBLE_EQ(keeping(curve, 1.0).threshold, 0.7);
}

TEST(Roc, AreaCountsPairs) {
  // Of six pairs, four have the positive on top.
  EXPECT_NEAR(area_under(roc_curve({0.9, 0.3, 0.5}, {0.4, 0.35})), 4.0 / 6.0, 1e-12);
  // A tie counts half.
  EXPECT_DOUBLE_EQ(area_under(roc_curve({0.5}, {0.5})), 0.5);
  EXPECT_DOUBLE_EQ(area_under(roc_curve({0.1}, {0.5})), 0.0);
}

TEST(Roc, KeepingAPartOfThePositives) {
  const auto curve = roc_curve({0.9, 0.8, 0.6, 0.2}, {0.7, 0.5, 0.3, 0.1});
  const RocPoint half = keeping(curve, 0.5);
  EXPECT_DOUBLE_EQ(half.threshold, 0.8);
  EXPECT_DOUBLE_EQ(half.false_alarms, 0.0);
  const RocPoint most = keeping(curve, 0.75);
  EXPECT_DOUBLE_EQ(most.threshold, 0.6);
  EXPECT_DOUBLE_EQ(most.false_alarms, 0.25);
  EXPECT_DOUBLE_EQ(keeping(curve, 1.0).false_alarms, 0.75);
}

TEST(Roc, AtAThresholdBetweenScores) {
  const auto curve = roc_curve({0.9, 0.8, 0.6, 0.2}, {0.7, 0.5, 0.3, 0.1});
  const RocPoint point = at_threshold(curve, 0.65);
  EXPECT_DOUBLE_EQ(point.kept, 0.5);
  EXPECT_DOUBLE_EQ(point.false_alarms, 0.25);
  EXPECT_DOUBLE_EQ(at_threshold(curve, 0.8).kept, 0.5) << "what scores the threshold itself is kept";
  EXPECT_DOUBLE_EQ(at_threshold(curve, 2.0).kept, 0.0);
  EXPECT_DOUBLE_EQ(at_threshold(curve, 0.0).false_alarms, 1.0);
}

TEST(Roc, NothingToTellApart) {
  EXPECT_TRUE(roc_curve({}, {0.5}).empty());
  EXPECT_TRUE(roc_curve({0.5}, {}).empty());
  EXPECT_TRUE(std::isnan(area_under({})));
}

}  // namespace
}  // namespace gatefield::training
