#include <gtest/gtest.h>

#include <cmath>

#include "common/geometry/gate.h"
#include "tests/unit/server/planner/batch_fixture.h"

namespace gatefield::planner {
namespace {

using test::BatchFixture;
using test::context_at_origin;

/// Writes the straight flight from (x0, y0) by (dx, dy) per step and the exact field of a gate at the origin.
void fly(BatchFixture& fixture, int m, float x0, float y0, float dx, float dy, const PlanContext& context,
         bool with_field = true) {
  for (int k = 0; k < fixture.batch.steps; ++k) {
    const float x = x0 + dx * static_cast<float>(k + 1), y = y0 + dy * static_cast<float>(k + 1);
    fixture.place(k, m, {x, y, 0});
    if (with_field) fixture.field(k, m) = context.frame.inner_half_m + std::abs(x) * context.cone_slope - std::abs(y);
  }
}

PlanContext starting_at(float x, float y) {
  PlanContext context = context_at_origin();
  context.start_p_WB = {x, y, 0};
  context.start_along_m = x;
  context.start_clearance_m = context.frame.inner_half_m - std::abs(y);
  return context;
}

TEST(Annotation, StraightThroughTheMiddlePasses) {
  const PlanContext context = starting_at(-1.0f, 0.0f);
  BatchFixture fixture(8, 1);
  fly(fixture, 0, -1.0f, 0.0f, 0.24f, 0.0f, context);
  fixture.annotate(context);
  EXPECT_NEAR(fixture.along(3, 0), -0.04f, 1e-5f);
  EXPECT_EQ(fixture.through(3, 0), 0.0f);
  EXPECT_EQ(fixture.through(4, 0), 1.0f);
  EXPECT_EQ(fixture.through(7, 0), 1.0f);
  EXPECT_NEAR(fixture.crossing(0), 0.5f, 1e-4f);
}

TEST(Annotation, ObliqueCrossingLosesClearanceOverTheSlab) {
  const PlanContext context = starting_at(-1.0f, -1.0f);
  BatchFixture fixture(8, 1);
  fly(fixture, 0, -1.0f, -1.0f, 0.24f, 0.24f, context);  // through (0, 0) at 45 degrees
  fixture.annotate(context);
  EXPECT_EQ(fixture.through(7, 0), 1.0f);
  EXPECT_LT(fixture.crossing(0), 0.5f);
  EXPECT_GT(fixture.crossing(0), 0.5f - 0.24f - 0.16f - 1e-4f);  // never more pessimistic than a step's own length
}

TEST(Annotation, IntoTheFrameIsACrossingWithoutClearanceAndNotPassed) {
  const PlanContext context = starting_at(-1.0f, 0.6f);
  BatchFixture fixture(8, 1);
  fly(fixture, 0, -1.0f, 0.6f, 0.24f, 0.0f, context);
  fixture.annotate(context);
  EXPECT_EQ(fixture.through(7, 0), 0.0f);
  EXPECT_NEAR(fixture.crossing(0), -0.1f, 1e-4f);
}

TEST(Annotation, TheCornerOfASquareOpeningIsTheFrameOfARoundOne) {
  for (const auto opening : {GateShape::Opening::kSquare, GateShape::Opening::kRound}) {
    const GateShape shape{.opening = opening};
    const auto value = [&](const Eigen::Vector3f& p) {
      return static_cast<float>(guide_sdf(shape, p.cast<double>(), std::atan(context_at_origin().cone_slope)));
    };
    PlanContext context = context_at_origin();
    context.start_p_WB = {-1.0f, 0.4f, 0.4f};
    context.start_along_m = -1.0f;
    context.start_clearance_m = value(context.start_p_WB) - context.cone_slope;
    BatchFixture fixture(8, 1);
    for (int k = 0; k < fixture.batch.steps; ++k) {
      const Eigen::Vector3f p(-1.0f + 0.24f * static_cast<float>(k + 1), 0.4f, 0.4f);
      fixture.place(k, 0, p);
      fixture.field(k, 0) = value(p);
    }
    fixture.annotate(context);
    const bool round = opening == GateShape::Opening::kRound;
    EXPECT_EQ(fixture.through(7, 0), round ? 0.0f : 1.0f);
    EXPECT_NEAR(fixture.crossing(0), round ? 0.5f - std::hypot(0.4f, 0.4f) : 0.1f, 1e-3f);
  }
}

TEST(Annotation, ComingBackOutsideTheFrameIsFreeButThroughItIsNot) {
  const PlanContext outside = starting_at(1.0f, 2.0f);
  BatchFixture fixture(8, 1);
  fly(fixture, 0, 1.0f, 2.0f, -0.24f, 0.0f, outside);
  fixture.annotate(outside);
  EXPECT_EQ(fixture.crossing(0), kNoCrossing);

  const PlanContext through = starting_at(1.0f, 0.6f);
  fly(fixture, 0, 1.0f, 0.6f, -0.24f, 0.0f, through);
  fixture.annotate(through);
  EXPECT_LT(fixture.crossing(0), 0.0f);
  EXPECT_EQ(fixture.through(7, 0), 0.0f);
}

TEST(Annotation, TurningInTheOpeningMeetsThePost) {
  const PlanContext context = starting_at(-0.2f, 0.0f);
  BatchFixture fixture(5, 2);
  for (int k = 0; k < 5; ++k) {
    const float y = 0.15f * static_cast<float>(k + 1);
    const float x[] = {0.05f, 0.05f + 0.2f * static_cast<float>(k)};  // one stays in the slab, one leaves it
    for (int m = 0; m < 2; ++m) {
      fixture.place(k, m, {x[m], y, 0});
      fixture.field(k, m) = context.frame.inner_half_m + std::abs(x[m]) * context.cone_slope - y;
    }
  }
  fixture.annotate(context);
  EXPECT_EQ(fixture.through(0, 0), 1.0f);
  EXPECT_NEAR(fixture.crossing(0), -0.25f, 1e-4f);  // at y = 0.75
  EXPECT_GT(fixture.crossing(1), 0.2f);
}

TEST(Annotation, WithoutAFieldTheAxisIsTheMeasure) {
  const PlanContext context = starting_at(-1.0f, 0.2f);
  BatchFixture fixture(8, 1);
  fly(fixture, 0, -1.0f, 0.2f, 0.24f, 0.0f, context, false);
  fixture.annotate(context);
  EXPECT_EQ(fixture.through(7, 0), 1.0f);
  EXPECT_NEAR(fixture.crossing(0), 0.3f, 1e-3f);
}

TEST(Annotation, CrossingInTheFirstStepIsSeen) {
  const PlanContext context = starting_at(-0.1f, 0.0f);
  BatchFixture fixture(2, 100);
  for (int m = 0; m < 100; ++m) fly(fixture, m, -0.1f, 0.0f, 0.24f, 0.0f, context);
  fixture.annotate(context);
  for (int m = 0; m < 100; ++m) EXPECT_EQ(fixture.through(0, m), 1.0f) << m;
}

}  // namespace
}  // namespace gatefield::planner
