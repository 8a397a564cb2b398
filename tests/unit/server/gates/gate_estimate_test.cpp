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

TEST(GateEstimate, AGateOfTwiceTheSizeIsTheSameInTwiceTheLengths) {
  Random random(5);
  GateEstimate usual, large;
  for (int i = 0; i < 60; ++i) {
    const Eigen::Vector3d off = (i % 9 == 4 ? 0.6 : 0.08) * Eigen::Vector3d(random.normal(), random.normal(), 0.0);
    GateMeasurement measurement = measured(Eigen::Vector3d(5, 1, 1.5) + off, 0.05 * random.normal());
    measurement.distance_m = 5.0 - 0.08 * i;
    const bool taken = usual.update(measurement, from_seconds(i / 60.0));
    measurement.X_WG.translation() *= 2.0;
    measurement.center_sigma_m *= 2.0;
    measurement.distance_m *= 2.0;
    EXPECT_EQ(large.update(measurement, from_seconds(i / 60.0), 2.0), taken) << i;
    EXPECT_LT((large.X_WG().translation() - 2.0 * usual.X_WG().translation()).norm(), 1e-12) << i;
    EXPECT_NEAR(large.center_sigma_m(), 2.0 * usual.center_sigma_m(), 1e-12) << i;
  }
}

/// An estimate of a gate at (5, 0, 1.5), facing along x, that a vehicle at 8 m/s approaches from 6 m.
class Approach {
 public:
  Approach() {
    while (away_m_ > GateEstimate::kNear_m) see({5, 0, 1.5}, 0.0, 0.03);
  }
  /// The next frame, 1/60 s later.
  bool see(const Eigen::Vector3d& center_W, double yaw_rad, double sigma_m) {
    GateMeasurement measurement = measured(center_W, yaw_rad, sigma_m);
    measurement.distance_m = away_m_;
    away_m_ -= 8.0 / 60.0;
    return estimate.update(measurement, from_seconds(++frames_ / 60.0));
  }

  GateEstimate estimate;

 private:
  double away_m_ = 6.0;
  int frames_ = 0;
};

TEST(GateEstimate, NearAGateTheBeliefDoesNotSlideIntoAnotherOpening) {
  Approach approach;
  // Each frame lies a little below what is believed, as far as the test against outliers lets it.
  for (int i = 0; i < 15; ++i) {
    const Eigen::Vector3d believed_W = approach.estimate.X_WG().translation();
    approach.see(believed_W - Eigen::Vector3d(0, 0, 0.2), 0.0, 0.06);
  }
  EXPECT_GT(approach.estimate.X_WG().translation().z(), 1.5 - GateEstimate::kSlide_m);
}

TEST(GateEstimate, NearAGateNeitherAgreeingOutliersNorATurnedAxisAreBelieved) {
  Approach below, turned;
  for (int i = 0; i < 15; ++i) {
    EXPECT_FALSE(below.see({5, 0, 0.6}, 0.0, 0.06));
    EXPECT_FALSE(turned.see({5, 0.1, 1.5}, 1.2, 0.06));
  }
  EXPECT_NEAR(below.estimate.X_WG().translation().z(), 1.5, 1e-9);
  EXPECT_NEAR(turned.estimate.X_WG().linear()(0, 0), 1.0, 1e-9);
}

TEST(GateEstimate, ABeliefThatIsStillOnItsWayBindsNothing) {
  GateEstimate estimate;
  const auto see = [&](double z_m, double distance_m, int frame) {
    GateMeasurement measurement = measured({5, 0, z_m}, 0.0, 0.1);
    measurement.distance_m = distance_m;
    estimate.update(measurement, from_seconds(frame / 60.0));
  };
  // First seen between the legs; each frame says "higher".
  for (int frame = 0; frame < 20; ++frame) see(estimate.X_WG().translation().z() + 0.25, 5.0, frame);
  const double from_afar_m = estimate.X_WG().translation().z();
  for (int frame = 20; frame < 60; ++frame) see(from_afar_m + 0.6, 2.0, frame);
  EXPECT_GT(estimate.X_WG().translation().z(), from_afar_m + 0.5);
}

TEST(GateEstimate, NearAGateWhatIsSeenIsStillRefined) {
  Approach approach;
  for (int i = 0; i < 15; ++i) EXPECT_TRUE(approach.see({5, 0.12, 1.5}, 0.2, 0.03));
  EXPECT_NEAR(approach.estimate.X_WG().translation().y(), 0.12, 0.03);
}

TEST(GateEstimate, FromAfarOutliersThatTurnTheAxisHaveToAgreeForLonger) {
  for (const double yaw_rad : {0.2, 1.2}) {
    GateEstimate estimate;
    const auto see = [&](const Eigen::Vector3d& center_W, double yaw, int frame) {
      GateMeasurement measurement = measured(center_W, yaw, 0.05);
      measurement.distance_m = 5.0;
      return estimate.update(measurement, from_seconds(frame / 60.0));
    };
    int frame = 0;
    for (; frame < 20; ++frame) see({5, 0, 1.5}, 0.0, frame);
    int agreeing = 1;
    while (!see({5, 1.5, 1.5}, yaw_rad, frame++)) ++agreeing;
    EXPECT_EQ(agreeing, yaw_rad < GateEstimate::kTurn_rad ? 4 : GateEstimate::kTurnedOutliersToRestart);
  }
}

TEST(GateEstimate, WhatWasSeenFromAfarLongAgoBindsNobody) {
  Approach approach;
  GateMeasurement measurement = measured({5, 0, 0.6}, 0.0, 0.06);
  measurement.distance_m = 1.0;
  for (int i = 0; i < 4; ++i) approach.estimate.update(measurement, from_seconds(10.0 + i / 60.0));
  EXPECT_NEAR(approach.estimate.X_WG().translation().z(), 0.6, 0.05);
}

TEST(GateEstimate, NearerMeasurementsWeighMore) {
  GateEstimate estimate;
  estimate.update(measured({5, 1, 1.5}, 0, 0.2), from_seconds(0));
  estimate.update(measured({5.2, 1, 1.5}, 0, 0.03), from_seconds(0.02));
  EXPECT_GT(estimate.X_WG().translation().x(), 5.15);
}

}  // namespace
}  // namespace gatefield::gates
