#include "server/planner/warm_start.h"

#include <gtest/gtest.h>

#include <limits>
#include <vector>

namespace gatefield::planner {
namespace {

std::vector<PlainVector4> ramp() {
  std::vector<PlainVector4> inputs;
  for (int k = 0; k < 5; ++k) inputs.emplace_back(PlainVector4::Constant(k + 1.0));
  return inputs;
}

TEST(WarmStart, WholeStepsMoveEntriesAndTheTailIsZero) {
  auto inputs = ramp();
  shift_plan(0.06, 0.03, PlainVector4::Zero(), inputs);
  EXPECT_NEAR(inputs[0][0], 3.0, 1e-9);
  EXPECT_NEAR(inputs[2][3], 5.0, 1e-9);
  EXPECT_NEAR(inputs[3][0], 0.0, 1e-9);
}

TEST(WarmStart, PartsOfAStepAreInterpolated) {
  auto inputs = ramp();
  shift_plan(0.01, 0.03, PlainVector4::Zero(), inputs);
  EXPECT_NEAR(inputs[0][0], 1.0 + 1.0 / 3.0, 1e-9);
  EXPECT_NEAR(inputs[4][0], 5.0 * 2.0 / 3.0, 1e-9);
}

TEST(WarmStart, NothingElapsedNothingChanged) {
  auto inputs = ramp();
  shift_plan(0.0, 0.03, PlainVector4::Zero(), inputs);
  shift_plan(-1.0, 0.03, PlainVector4::Zero(), inputs);
  shift_plan(std::numeric_limits<double>::quiet_NaN(), 0.03, PlainVector4::Zero(), inputs);
  EXPECT_EQ(inputs, ramp());
}

TEST(WarmStart, LongerThanThePlanClearsIt) {
  auto inputs = ramp();
  shift_plan(10.0, 0.03, PlainVector4::Zero(), inputs);
  for (const PlainVector4& u : inputs) EXPECT_TRUE(u.isZero());
  shift_plan(std::numeric_limits<double>::infinity(), 0.03, PlainVector4::Zero(), inputs);
}

TEST(WarmStart, WhatLiesBeyondTheEndMayBeTheLastInput) {
  std::vector<PlainVector4> inputs = ramp();
  shift_plan(0.06, 0.03, inputs.back(), inputs);
  EXPECT_EQ(inputs[0][0], 3.0);
  for (const std::size_t k : {2u, 3u, 4u}) EXPECT_EQ(inputs[k][0], 5.0) << k;
}

}  // namespace
}  // namespace gatefield::planner
