#include "server/planner/applied_disturbance.h"

#include <gtest/gtest.h>

#include "tests/unit/server/planner/batch_fixture.h"

namespace gatefield::planner {
namespace {

TEST(AppliedDisturbance, MovesPositionsAndVelocitiesAsAConstantAccelerationDoes) {
  test::BatchFixture fixture(4, 5);
  fixture.place(3, 2, {1, 2, 3});
  apply_disturbance({2.0, 0.0, -1.0}, 0.05, fixture.batch);
  const float t_s = 4 * 0.05f;  // the end of step 3
  EXPECT_NEAR(fixture.at(3, kernels::kPx, 2), 1 + 0.5f * t_s * t_s * 2.0f, 1e-6f);
  EXPECT_NEAR(fixture.at(3, kernels::kPy, 2), 2, 1e-6f);
  EXPECT_NEAR(fixture.at(3, kernels::kPz, 2), 3 - 0.5f * t_s * t_s, 1e-6f);
  EXPECT_NEAR(fixture.at(3, kernels::kVx, 2), 2.0f * t_s, 1e-6f);
  EXPECT_NEAR(fixture.at(3, kernels::kVz, 2), -t_s, 1e-6f);
  EXPECT_EQ(fixture.at(3, kernels::kQw, 2), 1.0f);
}

TEST(AppliedDisturbance, StepByStepItComesToTheSame) {
  const Eigen::Vector3d a_W(1.5, -0.5, 0.25);
  QuadrotorState state;
  for (int k = 0; k < 20; ++k) {
    state.p_WB += 0.03 * state.v_WB;  // what a model without drag does
    apply_disturbance(a_W, 0.03, &state);
  }
  EXPECT_LT((state.p_WB - 0.5 * 0.6 * 0.6 * a_W).norm(), 1e-12);
  EXPECT_LT((state.v_WB - 0.6 * a_W).norm(), 1e-12);
}

}  // namespace
}  // namespace gatefield::planner
