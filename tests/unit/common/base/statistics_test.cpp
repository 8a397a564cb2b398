#include "common/base/statistics.h"

#include <gtest/gtest.h>

#include <cmath>

namespace gatefield {
namespace {

TEST(Quantile, GoesFromTheSmallestToTheLargestValue) {
  EXPECT_EQ(quantile({5, 1, 4, 2, 3}, 0.0), 1);
  EXPECT_EQ(quantile({5, 1, 4, 2, 3}, 0.5), 3);
  EXPECT_EQ(quantile({5, 1, 4, 2, 3}, 1.0), 5);
  EXPECT_EQ(quantile({1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11}, 0.9), 10);
  EXPECT_EQ(quantile({7}, 0.3, Between::kLinear), 7);
}

TEST(Quantile, BetweenTwoValuesIsTheNearerOne) {
  EXPECT_EQ(quantile({1, 2, 4, 8}, 0.4), 2);  // place 1.2
  EXPECT_EQ(quantile({1, 2, 4, 8}, 0.6), 4);  // place 1.8
  EXPECT_EQ(quantile({1, 2, 4, 8}, 0.5), 4) << "half-way: the larger one";
}

TEST(Quantile, BetweenTwoValuesLiesOnTheLineWhenAskedTo) {
  EXPECT_EQ(quantile({8, 1, 4, 2}, 0.5, Between::kLinear), 3) << "the mean of the middle two";
  EXPECT_NEAR(quantile({8, 1, 4, 2}, 0.9, Between::kLinear), 6.8, 1e-12);  // R: quantile(c(8, 1, 4, 2), 0.9)
  EXPECT_EQ(quantile({8, 1, 4, 2}, 1.0, Between::kLinear), 8);
}

TEST(Quantile, OfNothingIsNotANumber) {
  EXPECT_TRUE(std::isnan(quantile({}, 0.5)));
  EXPECT_TRUE(std::isnan(quantile({}, 0.5, Between::kLinear)));
}

TEST(Quantile, InPlaceTakesSinglePrecision) {
  std::vector<float> values{3.0f, 1.0f, 2.0f};
  EXPECT_EQ(quantile_in_place(std::span(values), 0.5), 2.0f);
}

}  // namespace
}  // namespace gatefield
