#include "server/training/evaluation/statistics.h"

#include <gtest/gtest.h>

#include <cmath>

namespace gatefield::training {
namespace {

TEST(Spearman, SeesOrderOnly) {
  EXPECT_DOUBLE_EQ(spearman({1, 2, 3, 4}, {1, 8, 27, 1000}), 1.0);
  EXPECT_DOUBLE_EQ(spearman({1, 2, 3, 4}, {4, 3, 2, 1}), -1.0);
}

TEST(Spearman, EqualValuesShareTheirRank) {
  // Ranks 0.5 0.5 2 3 against 0 1 2 3.
  EXPECT_NEAR(spearman({1, 1, 2, 3}, {1, 2, 3, 4}), 4.5 / std::sqrt(4.5 * 5.0), 1e-12);
  EXPECT_TRUE(std::isnan(spearman({1, 1, 1, 1}, {1, 2, 3, 4})));
}

TEST(ConstantBaseline, BestConstantIsTheMedian) {
  EXPECT_DOUBLE_EQ(constant_error({0.0f, 1.0f, 5.0f}), 5.0 / 3.0);
  EXPECT_DOUBLE_EQ(constant_sign_percent({1.0f, -1.0f, -2.0f, -3.0f}), 75.0);
  EXPECT_TRUE(std::isnan(constant_error({})));
}

}  // namespace
}  // namespace gatefield::training
