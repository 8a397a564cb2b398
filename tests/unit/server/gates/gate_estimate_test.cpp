#include "server/gates/gate_estimate.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "common/base/random.h"
#include "tests/support/analytic_field.h"

namespace gatefield::gates {
namespace {

GateMeasurement measured(const Eigen::Vector3d& center_W, double yaw_rad, double sigma_m = 0.1) {
  return {test::upright_gate(center_W, yaw_rad), sigma_m, sigma_m};
}

TEST(GateEstimate, AveragesNoiseOverFrames) {
  Random random(3);
  GateEstimate estimate;
  for (int i = 0; i < 60; ++i) {
    const Eigen::Vector3d noise(random.normal(), random.normal(), random.normal());
    estimate.update(measured(Eigen::Vector3d(5, 1, 1.5) + 0.1 * noise, 0.3 + 0.1 * random.normal()),
                    from_seconds(i / 60.0));
  }
  EXPECT_LT((estimate.X_WG().translation() - Eigen::Vector3d(5, 1, 1.5)).norm(), 0.08);
  EXPECT_NEAR(std::atan2(estimate.X_WG().linear()(1, 0), estimate.X_WG().linear()(0, 0)), 0.3, 0.08);
  EXPECT_LT(estimate.center_sigma_m(), 0.06);
}

TEST(GateEstimate, OneOutlierIsSetAside) {
  GateEstimate estimate;
  for (int i = 0; i < 10; ++i) estimate.update(measured({5, 1, 1.5}, 0), from_seconds(i / 60.0));
  EXPECT_FALSE(estimate.update(measured({7, 1, 1.5}, 0), from_seconds(0.2)));
  EXPECT_NEAR(estimate.X_WG().translation().x(), 5.0, 1e-9);
}

TEST(GateEstimate, OutliersThatAgreeWin) {
  GateEstimate estimate;
  for (int i = 0; i < 10; ++i) estimate.update(measured({5, 1, 1.5}, 0), from_seconds(i / 60.0));
  for (int i = 0; i < 4; ++i) estimate.update(measured({6.5, 1, 1.5}, 0), from_seconds(0.2 + i / 60.0));
  EXPECT_NEAR(estimate.X_WG().translation().x(), 6.5, 1e-6);
}

TEST(GateEstimate, TheOppositeAxisIsTheSameGate) {
  GateEstimate estimate;
  estimate.update(measured({5, 1, 1.5}, 0.0), from_seconds(0));
  estimate.update(measured({5, 1, 1.5}, 3.14159265), from_seconds(0.02));
  EXPECT_GT(estimate.X_WG().linear()(0, 0), 0.99);
}

TEST(GateEstimate, AFirstWordOnThePassingDirectionDoesNotLast) {
  // A gate turned by 50 degrees, whose first fit from afar is 95 degrees off the course: called by its opposite.
  const auto against_course = [](double yaw_rad) {
    return std::cos(yaw_rad) < 0 ? yaw_rad - std::numbers::pi : yaw_rad;
  };
  Random random(7);
  GateEstimate estimate;
  estimate.update(measured({5, 1, 1.5}, against_course(1.66)), from_seconds(0));
  EXPECT_LT(estimate.X_WG().linear()(1, 0), -0.9);
  for (int i = 1; i < 12; ++i)
    estimate.update(measured({5, 1, 1.5}, against_course(0.87 + 0.1 * random.normal())), from_seconds(i / 60.0));
  const Eigen::Vector3d axis_W = estimate.X_WG().linear().col(0);
  EXPECT_NEAR(std::atan2(axis_W.y(), axis_W.x()), 0.87, 0.15);
  EXPECT_NEAR(estimate.X_WG().linear().determinant(), 1.0, 1e-9);
}

TEST(GateEstimate, NearerMeasurementsWeighMore) {
  GateEstimate estimate;
  estimate.update(measured({5, 1, 1.5}, 0, 0.2), from_seconds(0));
  estimate.update(measured({5.2, 1, 1.5}, 0, 0.03), from_seconds(0.02));
  EXPECT_GT(estimate.X_WG().translation().x(), 5.15);
}

}  // namespace
}  // namespace gatefield::gates
