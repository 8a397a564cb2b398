#include "server/perception/gate_estimate.h"

#include <gtest/gtest.h>

#include "common/base/random.h"
#include "tests/support/analytic_field.h"

namespace gatefield::perception {
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

TEST(GateEstimate, NearerMeasurementsWeighMore) {
  GateEstimate estimate;
  estimate.update(measured({5, 1, 1.5}, 0, 0.2), from_seconds(0));
  estimate.update(measured({5.2, 1, 1.5}, 0, 0.03), from_seconds(0.02));
  EXPECT_GT(estimate.X_WG().translation().x(), 5.15);
}

}  // namespace
}  // namespace gatefield::perception
