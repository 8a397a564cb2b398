#include "server/planner/warm_start.h"

#include <gtest/gtest.h>

#include <limits>
#include <vector>

namespace gatefield::planner {
namespace {

std::vector<ThrustRates> ramp() {
  std::vector<ThrustRates> inputs;
  for (int k = 0; k < 5; ++k) inputs.push_back(ThrustRates::Constant(k + 1.0));
  return inputs;
}

TEST(WarmStart, WholeStepsMoveEntriesAndTheTailIsZero) {
  auto inputs = ramp();
  shift_plan(0.06, 0.03, inputs);
  EXPECT_NEAR(inputs[0][0], 3.0, 1e-9);
  EXPECT_NEAR(inputs[2][3], 5.0, 1e-9);
  EXPECT_NEAR(inputs[3][0], 0.0, 1e-9);
}

TEST(WarmStart, PartsOfAStepAreInterpolated) {
  auto inputs = ramp();
  shift_plan(0.01, 0.03, inputs);
  EXPECT_NEAR(inputs[0][0], 1.0 + 1.0 / 3.0, 1e-9);
  EXPECT_NEAR(inputs[4][0], 5.0 * 2.0 / 3.0, 1e-9);
}

TEST(WarmStart, NothingElapsedNothingChanged) {
  auto inputs = ramp();
  shift_plan(0.0, 0.03, inputs);
  shift_plan(-1.0, 0.03, inputs);
  shift_plan(std::numeric_limits<double>::quiet_NaN(), 0.03, inputs);
  EXPECT_EQ(inputs, ramp());
}

TEST(WarmStart, LongerThanThePlanClearsIt) {
  auto inputs = ramp();
  shift_plan(10.0, 0.03, inputs);
  for (const ThrustRates& u : inputs) EXPECT_TRUE(u.isZero());
  shift_plan(std::numeric_limits<double>::infinity(), 0.03, inputs);
}

}  // namespace
}  // namespace gatefield::planner
