#include "server/perception/learned/hourglass_fit.h"

#include <gtest/gtest.h>

#include <limits>

#include "common/base/random.h"
#include "tests/support/analytic_field.h"

namespace gatefield::perception {
namespace {

using test::AnalyticField;
using test::upright_gate;

double axis_error_rad(const HourglassFit& fit, const Eigen::Isometry3d& X_WG) {
  return std::acos(std::min(1.0, std::abs(fit.X_WG.linear().col(0).dot(X_WG.linear().col(0)))));
}

TEST(HourglassFit, FindsCentreAndAxisFromValuesAlone) {
  Random random(11);
  for (int trial = 0; trial < 40; ++trial) {
    Eigen::Isometry3d X_WG =
        upright_gate({random.uniform(-5, 5), random.uniform(-5, 5), 1.5}, random.uniform(-1.2, 1.2));
    X_WG.linear() =
        X_WG.linear() * Eigen::AngleAxisd(random.uniform(-0.4, 0.4), Eigen::Vector3d::UnitY()).toRotationMatrix();
    const Eigen::Vector3d off(random.uniform(-0.15, 0.15), random.uniform(-0.15, 0.15), random.uniform(-0.15, 0.15));
    const HourglassFit fit =
        fit_hourglass(AnalyticField(X_WG), GateShape{}, kGuideConeAngle_rad, X_WG.translation() + off, {1, 0, 0});
    ASSERT_TRUE(fit.ok) << trial;
    EXPECT_LT((fit.X_WG.translation() - X_WG.translation()).norm(), 0.02) << trial;
    EXPECT_LT(axis_error_rad(fit, X_WG), 0.03) << trial;
    EXPECT_GT(fit.X_WG.linear()(0, 0), 0.0) << trial;
    EXPECT_LT(fit.rms_m, 0.02) << trial;
  }
}

TEST(HourglassFit, RoundOpeningsToo) {
  GateShape shape;
  shape.opening = GateShape::Opening::kRound;
  const Eigen::Isometry3d X_WG = upright_gate({4, 1, 2}, 0.5);
  const HourglassFit fit =
      fit_hourglass(AnalyticField(X_WG, shape), shape, kGuideConeAngle_rad, {4.1, 0.9, 2.05}, {1, 0, 0});
  ASSERT_TRUE(fit.ok);
  EXPECT_LT((fit.X_WG.translation() - X_WG.translation()).norm(), 0.02);
  EXPECT_LT(axis_error_rad(fit, X_WG), 0.03);
}

TEST(HourglassFit, FindsGatesOfAnySizeAsWell) {
  for (const double size : {0.3, 1.0, 3.0}) {
    const GateShape shape{.inner_half_m = 0.5 * size, .outer_half_m = 0.75 * size};
    const Eigen::Isometry3d X_WG = upright_gate(size * Eigen::Vector3d(4, 1, 2), 0.7);
    const HourglassFit fit = fit_hourglass(AnalyticField(X_WG, shape), shape, kGuideConeAngle_rad,
                                           size * Eigen::Vector3d(4.1, 0.85, 2.1), {1, 0, 0});
    ASSERT_TRUE(fit.ok) << size;
    EXPECT_LT((fit.X_WG.translation() - X_WG.translation()).norm(), 0.02 * size) << size;
    EXPECT_LT(axis_error_rad(fit, X_WG), 0.03) << size;
    EXPECT_LT(fit.rms_m, 0.02 * size) << size;
  }
}

class Flat final : public gates::Field {
 public:
  explicit Flat(float value) : value_(value) {}
  void evaluate(std::span<const float>, std::span<const float>, std::span<const float>,
                std::span<float> sdf_m) const noexcept override {
    std::fill(sdf_m.begin(), sdf_m.end(), value_);
  }

 private:
  float value_;
};

TEST(HourglassFit, AFieldWithoutAGateFitsBadly) {
  const HourglassFit fit = fit_hourglass(Flat(-0.3f), GateShape{}, kGuideConeAngle_rad, {0, 0, 0}, {1, 0, 0});
  EXPECT_TRUE(!fit.ok || fit.rms_m > 0.16);
}

TEST(HourglassFit, ValuesThatAreNotFiniteAreNoGate) {
  EXPECT_FALSE(fit_hourglass(Flat(std::numeric_limits<float>::quiet_NaN()), GateShape{}, kGuideConeAngle_rad, {0, 0, 0},
                             {1, 0, 0})
                   .ok);
  EXPECT_FALSE(fit_hourglass(Flat(0), GateShape{}, kGuideConeAngle_rad, {std::nan(""), 0, 0}, {1, 0, 0}).ok);
}

}  // namespace
}  // namespace gatefield::perception
