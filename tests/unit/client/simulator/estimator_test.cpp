#include "client/simulator/estimator.h"

#include <gtest/gtest.h>

#include <cmath>

namespace gatefield::simulator {
namespace {

using config::WorldPart;
using namespace std::chrono_literals;

constexpr int kFlights = 400;

config::EstimateErrors errors(WorldPart part) { return config::hard_world({part}).estimate; }

QuadrotorState flying(double t_s, double speed_m_s) {
  QuadrotorState state;
  state.p_WB = {speed_m_s * t_s, 0, 1.5};
  state.v_WB = {speed_m_s, 0, 0};
  return state;
}

double yaw_of(const QuadrotorState& state) {
  const Eigen::Vector3d x_W = state.q_WB * Eigen::Vector3d::UnitX();
  return std::atan2(x_W.y(), x_W.x());
}

/// Variance of what a first-order Gauss-Markov process of that sigma integrates to, begun with its own spread.
double integrated_variance(double sigma, double correlation_s, double t_s) {
  return 2 * sigma * sigma * correlation_s * (t_s - correlation_s * (1 - std::exp(-t_s / correlation_s)));
}

TEST(Estimator, WithoutErrorsItIsTheTruth) {
  Estimator estimator({}, {}, 1);
  const QuadrotorState truth = flying(1, 8), state = estimator.estimate(1s, truth);
  EXPECT_EQ(state.p_WB, truth.p_WB);
  EXPECT_EQ(state.q_WB.coeffs(), truth.q_WB.coeffs());
  EXPECT_TRUE(estimator.frame().isApprox(Eigen::Isometry3d::Identity(), 0.0));
}

TEST(Estimator, DriftHasTheSpreadOfItsProcess) {
  const config::EstimateErrors sizes = errors(WorldPart::kDrift);
  Eigen::Vector3d position = Eigen::Vector3d::Zero(), velocity = Eigen::Vector3d::Zero();
  double yaw = 0, tilt = 0;
  constexpr double kTime_s = 10;
  for (std::uint64_t seed = 1; seed <= kFlights; ++seed) {
    Estimator estimator({}, sizes, seed);
    QuadrotorState state;
    for (Stamp now{0}; now <= from_seconds(kTime_s); now += 10ms) state = estimator.estimate(now, flying(0, 0));
    position += (state.p_WB - Eigen::Vector3d(0, 0, 1.5)).cwiseAbs2() / kFlights;
    velocity += state.v_WB.cwiseAbs2() / kFlights;
    yaw += std::pow(yaw_of(state), 2) / kFlights;
    const Eigen::Vector3d z_W = state.q_WB * Eigen::Vector3d::UnitZ();
    tilt += z_W.head<2>().squaredNorm() / 2 / kFlights;
  }
  // A variance out of n draws is right to sqrt(2 / n); three and a half of that.
  const double room = 3.5 * std::sqrt(2.0 / kFlights);
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(position[axis] / integrated_variance(sizes.drift_m_s, sizes.drift_s, kTime_s), 1.0, room) << axis;
    EXPECT_NEAR(velocity[axis] / std::pow(sizes.drift_m_s, 2), 1.0, room) << axis;
  }
  EXPECT_NEAR(yaw / integrated_variance(sizes.drift_yaw_rad_s, sizes.drift_s, kTime_s), 1.0, room);
  EXPECT_NEAR(tilt / std::pow(sizes.drift_tilt_rad, 2), 1.0, room);
}

TEST(Estimator, DriftDoesNotDependOnHowOftenItIsAsked) {
  // Spreads again, of a coarse and a fine step: the process is exact over any of them.
  config::EstimateErrors sizes;
  sizes.drift_m_s = 0.1;
  for (const Stamp step : {Stamp(5ms), Stamp(500ms)}) {
    double velocity = 0;
    for (std::uint64_t seed = 1; seed <= kFlights; ++seed) {
      Estimator estimator({}, sizes, seed);
      QuadrotorState state;
      for (Stamp now{0}; now <= 3s; now += step) state = estimator.estimate(now, flying(0, 0));
      velocity += state.v_WB.squaredNorm() / 3 / kFlights;
    }
    EXPECT_NEAR(velocity / 0.01, 1.0, 3.5 * std::sqrt(2.0 / 3 / kFlights));
  }
}

TEST(Estimator, PositionIsWhatItsOwnVelocityLeadsTo) {
  Estimator estimator({}, errors(WorldPart::kDrift), 7);
  QuadrotorState before = estimator.estimate(0s, flying(0, 8));
  for (int ms = 1; ms <= 5000; ++ms) {
    const QuadrotorState state = estimator.estimate(ms * 1ms, flying(1e-3 * ms, 8));
    const Eigen::Vector3d way_m = 0.5e-3 * (before.v_WB + state.v_WB);
    ASSERT_LT((state.p_WB - before.p_WB - way_m).norm(), 2e-5) << ms;
    before = state;
  }
  EXPECT_GT((before.p_WB - flying(5, 8).p_WB).norm(), 0.01) << "it drifts";
}

TEST(Estimator, ItsFrameTellsWhereThingsAreForIt) {
  config::EstimateErrors sizes = config::hard_world({WorldPart::kDrift, WorldPart::kJumps}).estimate;
  sizes.drift_tilt_rad = 0;
  Estimator estimator({}, sizes, 3);
  const Eigen::Vector3d gate_W(3, 4, 1);
  for (int ms = 0; ms <= 8000; ++ms) {
    const QuadrotorState truth = flying(1e-3 * ms, 2), state = estimator.estimate(ms * 1ms, truth);
    // Seen from the vehicle, the gate is where it is.
    const Eigen::Vector3d seen_B = truth.q_WB.conjugate() * (gate_W - truth.p_WB);
    ASSERT_LT((state.q_WB * seen_B + state.p_WB - estimator.frame() * gate_W).norm(), 1e-9);
  }
  EXPECT_GT((estimator.frame() * gate_W - gate_W).norm(), 0.01);
}

TEST(Estimator, JumpsComeAsOftenAndAsFarAsTold) {
  const config::EstimateErrors sizes = errors(WorldPart::kJumps);
  int jumps = 0;
  double squares = 0;
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    Estimator estimator({}, sizes, seed);
    Eigen::Vector3d before = estimator.estimate(0s, flying(0, 0)).p_WB;
    for (Stamp now = 10ms; now <= 50s; now += 10ms) {
      const Eigen::Vector3d p_WB = estimator.estimate(now, flying(0, 0)).p_WB;
      if (p_WB == before) continue;
      ++jumps;
      squares += (p_WB - before).squaredNorm() / 3;
      before = p_WB;
    }
  }
  const double expected = 60 * 50 * sizes.jumps_hz;
  EXPECT_NEAR(jumps, expected, 4 * std::sqrt(expected));
  EXPECT_NEAR(squares / jumps, std::pow(sizes.jump_m, 2), 4 * std::pow(sizes.jump_m, 2) * std::sqrt(2.0 / 3 / jumps));
}

TEST(Estimator, LagShowsTheStateOfBefore) {
  config::EstimateErrors sizes;
  sizes.lag = 15ms;
  Estimator estimator({}, sizes, 1);
  for (int ms = 0; ms < 200; ++ms) {
    const QuadrotorState state = estimator.estimate(ms * 1ms, flying(1e-3 * ms, 8));
    EXPECT_NEAR(state.p_WB.x(), 8e-3 * std::max(ms - 15, 0), 1e-12) << ms;
  }
  // Steps that came late.
  EXPECT_NEAR(estimator.estimate(230ms, flying(0.230, 8)).p_WB.x(), 8 * 0.199, 1e-12);
  EXPECT_NEAR(estimator.estimate(231ms, flying(0.231, 8)).p_WB.x(), 8 * 0.199, 1e-12);
}

TEST(Estimator, OnePartDrawsNothingOfAnothers) {
  const config::StateNoise white{0.01, 0.05, 0.004, 0.02};
  config::EstimateErrors jumpy = errors(WorldPart::kJumps), both = jumpy;
  both.drift_m_s = 0.03;
  Estimator a({}, jumpy, 5), b({}, both, 5), c(white, {}, 5), d(white, jumpy, 5);
  for (Stamp now{0}; now <= 20s; now += 20ms) {
    const Eigen::Vector3d jumped = a.estimate(now, flying(0, 0)).p_WB;
    b.estimate(now, flying(0, 0));
    const Eigen::Vector3d noisy = c.estimate(now, flying(0, 0)).v_WB;
    ASSERT_LT((d.estimate(now, flying(0, 0)).v_WB - noisy).norm(), 1e-12);
    ASSERT_LT((a.frame().linear() - b.frame().linear()).norm(), 1e-12) << "the same jumps of the heading";
    ASSERT_TRUE(jumped.allFinite());
  }
  EXPECT_GT((a.frame().matrix() - Eigen::Matrix4d::Identity()).norm(), 0.01);
}

}  // namespace
}  // namespace gatefield::simulator
