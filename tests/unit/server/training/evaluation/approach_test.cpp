#include "server/training/evaluation/approach.h"

#include <gtest/gtest.h>

#include <cmath>

#include "server/training/evaluation/wrong_gate.h"

namespace gatefield::training {
namespace {

using Eigen::Vector3d;

/// Flights whose errors are put together from known parts, each normal per axis.
ApproachFlights flights_of(double noise_m, double window_m, double flight_m, const Vector3d& global_G) {
  Random random(3);
  const auto draw = [&](double sigma_m) -> Vector3d {
    return sigma_m * Vector3d(random.normal(), random.normal(), random.normal());
  };
  ApproachFlights flights(400);
  for (auto& flight : flights) {
    const Vector3d of_flight = global_G + draw(flight_m);
    for (int window = 0; window < 4; ++window) {
      const Vector3d of_window = of_flight + draw(window_m);
      for (int i = 0; i < 10; ++i) {
        ApproachFrame frame;
        frame.valid = true;
        frame.distance_m = 8.0 - 2.0 * window;
        frame.frame_G = of_window + draw(noise_m);
        frame.memory_G = of_window;
        flight.push_back(frame);
      }
    }
  }
  return flights;
}

TEST(BiasAndNoise, FindsThePartsThatErrorsAreMadeOf) {
  const BiasAndNoise b = bias_and_noise(flights_of(0.03, 0.02, 0.01, {0.015, 0.0, 0.0}), 10);
  EXPECT_EQ(b.windows, 1600);
  EXPECT_EQ(b.left_out, 0);
  EXPECT_NEAR(b.noise_m2, 3 * 0.03 * 0.03, 0.05 * 3 * 0.03 * 0.03);
  EXPECT_NEAR(b.window_m2, 3 * 0.02 * 0.02, 0.1 * 3 * 0.02 * 0.02);
  EXPECT_NEAR(b.flight_m2, 3 * 0.01 * 0.01, 0.3 * 3 * 0.01 * 0.01);
  EXPECT_NEAR(b.global_m2, 0.015 * 0.015, 0.3 * 0.015 * 0.015);
  EXPECT_NEAR(b.mean_G.x(), 0.015, 0.002);
  EXPECT_NEAR(b.mean_G.y(), 0.0, 0.002);
}

TEST(BiasAndNoise, PureNoiseHasNoBias) {
  const BiasAndNoise b = bias_and_noise(flights_of(0.05, 0.0, 0.0, Vector3d::Zero()), 10);
  EXPECT_GT(b.noise_m2 / b.total_m2(), 0.98);
  EXPECT_NEAR(b.spread_median_m, std::sqrt(3.0) * 0.05, 0.005);
}

TEST(BiasAndNoise, LeavesWindowsWithAWrongCentreOut) {
  ApproachFlights flights = flights_of(0.03, 0.02, 0.01, Vector3d::Zero());
  flights[0][3].frame_G = Vector3d(kWrongGate_m + 0.1, 0, 0);
  flights[1][25].frame_G.reset();
  const BiasAndNoise b = bias_and_noise(flights, 10);
  EXPECT_EQ(b.left_out, 2);
  EXPECT_EQ(b.windows, 1598);
}

TEST(BiasAndNoise, AWindowIsFramesInARow) {
  ApproachFlights flights = flights_of(0.03, 0.02, 0.01, Vector3d::Zero());
  flights.resize(1);
  flights[0][5].valid = false;
  EXPECT_EQ(bias_and_noise(flights, 10).windows, 3);  // frames 6 to 15, 16 to 25, 26 to 35
}

TEST(ApproachRow, TakesValidFramesBetweenTheDistances) {
  ApproachFlights flights(1);
  const auto add = [&](double distance_m, bool valid, const std::optional<Vector3d>& found) {
    ApproachFrame frame;
    frame.distance_m = distance_m;
    frame.valid = valid;
    frame.frame_G = found;
    flights[0].push_back(frame);
  };
  add(1.5, true, Vector3d(0.01, 0, 0));
  add(1.6, true, Vector3d(0, 0.02, 0));
  add(1.7, true, std::nullopt);
  add(1.8, false, Vector3d(5, 0, 0));
  add(2.0, true, Vector3d(5, 0, 0));
  const ApproachRow row = approach_row(flights, 1.0, 2.0);
  EXPECT_EQ(row.count, 3);
  EXPECT_DOUBLE_EQ(row.frame_median_m, 0.02);
  EXPECT_DOUBLE_EQ(row.frame_p90_m, kFailedCenter_m) << "a field without a gate counts";
}

TEST(DrawApproach, FliesTowardTheGate) {
  const ApproachOptions options;
  for (std::uint64_t index = 0; index < 3; ++index) {
    const Approach flight = draw_approach(options, index);
    ASSERT_GT(flight.X_WC.size(), 15u);
    const Vector3d gate_W = flight.scenario.world.gates[0].X_WG.translation();
    EXPECT_NEAR((flight.X_WC.front().translation() - gate_W).norm(), options.from_m, 0.05);
    EXPECT_NEAR((flight.X_WC.back().translation() - gate_W).norm(), options.to_m, 0.4);
    EXPECT_NEAR((flight.nominal_W - gate_W).norm(), options.nominal_m, 1e-9);
    EXPECT_GT(flight.direction_W.dot((gate_W - flight.X_WC.back().translation()).normalized()), 0.5);
    const double step_s = seconds(flight.stamps[1] - flight.stamps[0]);
    const double speed_m_s = (flight.X_WC[1].translation() - flight.X_WC[0].translation()).norm() / step_s;
    EXPECT_GT(speed_m_s, 4.7);
    EXPECT_LT(speed_m_s, 9.3);
    EXPECT_GE(step_s, 1.0 / 61.0);
    EXPECT_LE(step_s, 1.0 / 29.0);
  }
}

TEST(DrawApproach, SameNameSameFlight) {
  const Approach a = draw_approach({}, 7);
  const Approach b = draw_approach({}, 7);
  ASSERT_EQ(a.X_WC.size(), b.X_WC.size());
  EXPECT_EQ(a.X_WC.back().matrix(), b.X_WC.back().matrix());
}

}  // namespace
}  // namespace gatefield::training
