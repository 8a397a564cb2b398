#include "common/geometry/gate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <numbers>

#include "common/base/random.h"

namespace gatefield {
namespace {

const double kSlope = std::tan(20.0 * std::numbers::pi / 180.0);

TEST(GuideSdf, IsTheHalfWidthAtTheCentreAndZeroAtTheOpeningsEdge) {
  const GateShape gate;
  EXPECT_DOUBLE_EQ(guide_sdf(gate, {0, 0, 0}), 0.5);
  EXPECT_NEAR(guide_sdf(gate, {0, 0.5, 0}), 0.0, 1e-15);
  EXPECT_NEAR(guide_sdf(gate, {0, -0.5, 0.5}), 0.0, 1e-15);  // a square opening has corners
  EXPECT_NEAR(guide_sdf(gate, {0, 0.1, -0.75}), -0.25, 1e-15);
}

TEST(GuideSdf, OpensAsAConeBeforeAndBehind) {
  const GateShape gate;
  for (const double x : {-3.0, -0.5, 0.5, 3.0}) {
    EXPECT_NEAR(guide_sdf(gate, {x, 0, 0}), 0.5 + std::abs(x) * kSlope, 1e-12);
    EXPECT_NEAR(guide_sdf(gate, {x, 0.5 + std::abs(x) * kSlope, 0}), 0.0, 1e-12);
  }
}

TEST(GuideSdf, RoundOpeningsMeasureInACircle) {
  const GateShape gate{.opening = GateShape::Opening::kRound};
  EXPECT_NEAR(guide_sdf(gate, {0, 0.3, 0.4}), 0.0, 1e-15);
  EXPECT_NEAR(guide_sdf(gate, {0, 0.5, 0.5}), 0.5 - std::sqrt(0.5), 1e-15);
}

TEST(GuideSdf, IsSymmetricAboutTheGatesThreePlanes) {
  const GateShape gate;
  Random random(1);
  for (int i = 0; i < 1000; ++i) {
    const Eigen::Vector3d p(random.uniform(-3, 3), random.uniform(-3, 3), random.uniform(-3, 3));
    const double s = guide_sdf(gate, p);
    EXPECT_DOUBLE_EQ(guide_sdf(gate, {-p.x(), p.y(), p.z()}), s);
    EXPECT_DOUBLE_EQ(guide_sdf(gate, {p.x(), -p.z(), p.y()}), s);  // a quarter turn about the axis
  }
}

TEST(GateValidation, NamesTheField) {
  EXPECT_TRUE(validate(GateShape{}).ok());
  const auto error_of = [](GateShape shape) { return validate(shape).error(); };
  EXPECT_THAT(error_of({.inner_half_m = 0.05}), testing::HasSubstr("gate.inner_half_m"));
  EXPECT_THAT(error_of({.inner_half_m = std::numeric_limits<double>::quiet_NaN()}),
              testing::HasSubstr("gate.inner_half_m"));
  EXPECT_THAT(error_of({.inner_half_m = 0.8}), testing::HasSubstr("gate.outer_half_m"));
  EXPECT_THAT(error_of({.thickness_m = 0.0}), testing::HasSubstr("gate.thickness_m"));
}

}  // namespace
}  // namespace gatefield
