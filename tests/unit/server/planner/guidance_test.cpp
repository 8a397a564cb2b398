#include "server/planner/costs/guidance.h"

#include <gtest/gtest.h>

namespace gatefield::planner {
namespace {

const Guidance kGate = make_guidance({2, 1, 1.5}, {0, 1, 0}, true, 0.7, 1.5, 0.75, 1.0);

TEST(Guidance, InTheConeItIsTheDistance) {
  EXPECT_NEAR(kGate.potential(2.5f, -1.0f, 1.5f), std::hypot(0.5f, 2.0f), 1e-5f);
}

TEST(Guidance, FromTheSideItLeadsToThePointInFront) {
  EXPECT_NEAR(kGate.potential(6.0f, 0.5f, 1.5f), std::hypot(4.0f, 1.0f) + 1.5f, 1e-5f);
}

TEST(Guidance, BeyondThePlaneItLeadsAroundTheFrame) {
  // Straight back through the frame must not look shorter than the way around.
  EXPECT_GT(kGate.potential(2.6f, 1.5f, 1.5f), kGate.potential(3.45f, 1.2f, 1.5f));
  EXPECT_GT(kGate.potential(2.6f, 1.5f, 1.5f), kGate.potential(2.0f, -1.0f, 1.5f) + 2.0f);
}

TEST(Guidance, NeverStepsUpOnTheWayIntoTheCone) {
  for (float lateral = 3.0f; lateral > 0.0f; lateral -= 0.01f) {
    const float before = kGate.potential(2.0f + lateral + 0.01f, -1.0f, 1.5f);
    EXPECT_LE(kGate.potential(2.0f + lateral, -1.0f, 1.5f), before + 1e-4f) << lateral;
  }
}

TEST(Guidance, WithoutFunnelItIsTheDistanceEverywhere) {
  const Guidance plain = make_guidance({0, 0, 0}, {1, 0, 0}, false, 0.7, 1.5, 0.75, 1.0);
  EXPECT_NEAR(plain.potential(3, 4, 0), 5.0f, 1e-5f);
}

TEST(Guidance, AVerticalAxisHasASideToo) {
  const Guidance vertical = make_guidance({0, 0, 3}, {0, 0, -1}, true, 0.7, 1.5, 0.75, 1.0);
  EXPECT_TRUE(std::isfinite(vertical.potential(0.2f, 0.1f, 1.0f)));
  EXPECT_NEAR(vertical.potential(0, 0, 5), 2.0f, 1e-5f);
}

}  // namespace
}  // namespace gatefield::planner
