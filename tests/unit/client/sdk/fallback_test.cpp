#include "client/sdk/fallback.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "common/base/random.h"

namespace gatefield::sdk {
namespace {

using namespace std::chrono_literals;

constexpr double kDegree = std::numbers::pi / 180.0;

double tilt_rad(const QuadrotorState& state) {
  return std::acos(std::clamp((state.q_WB * Eigen::Vector3d::UnitZ()).z(), -1.0, 1.0));
}

QuadrotorState hovering(const QuadrotorModel& model) {
  QuadrotorState state;
  state.p_WB = {1, 2, 5};
  state.thrust_n = state.thrust_command_n = hover_thrust_n(model);
  return state;
}

// What the flight was like.
struct Flight {
  QuadrotorState end;
  double lowest_m = 1e9, highest_m = -1e9, farthest_m = 0;
  double level_after_s = 0;  // last moment with more than 35 deg of tilt
};

Flight fly(Fallback* fallback, const QuadrotorModel& model, QuadrotorState state, Stamp from, Stamp length,
           Stamp period = 2ms) {
  Flight flight;
  const Eigen::Vector3d start = state.p_WB;
  for (Stamp now = from; now < from + length; now += period) {
    const Setpoint setpoint = fallback->update(now, state);
    EXPECT_TRUE(setpoint.thrust_rate_n_s.allFinite());
    EXPECT_LE(setpoint.thrust_rate_n_s.cwiseAbs().maxCoeff(), model.thrust_rate_max_n_s);
    EXPECT_GE(setpoint.rotor_thrust_n.minCoeff(), model.thrust_min_n);
    EXPECT_LE(setpoint.rotor_thrust_n.maxCoeff(), model.thrust_max_n);
    for (Stamp inner{0}; inner < period; inner += 1ms)
      state = step_reference(model, state, setpoint.thrust_rate_n_s, 1e-3);
    flight.lowest_m = std::min(flight.lowest_m, state.p_WB.z());
    flight.highest_m = std::max(flight.highest_m, state.p_WB.z());
    flight.farthest_m = std::max(flight.farthest_m, (state.p_WB - start).head<2>().norm());
    if (tilt_rad(state) > 35 * kDegree) flight.level_after_s = seconds(now - from);
  }
  flight.end = state;
  return flight;
}

TEST(Fallback, HoldsAHoverAsItIs) {
  const QuadrotorModel model;
  Fallback fallback(model);
  const Flight flight = fly(&fallback, model, hovering(model), 0s, 3s);
  EXPECT_NEAR(flight.end.p_WB.z(), 5, 1e-3);
  EXPECT_LT(flight.farthest_m, 1e-3);
}

TEST(Fallback, BrakesFromSixMetresPerSecondAt45Degrees) {
  const QuadrotorModel model;
  for (int heading = 0; heading < 360; heading += 30) {
    for (const double along : {-1.0, 1.0}) {  // tilted into the flight, and against it
      const Eigen::Vector3d direction(std::cos(heading * kDegree), std::sin(heading * kDegree), 0);
      QuadrotorState state = hovering(model);
      state.v_WB = 6.0 * along * direction;
      const Eigen::Vector3d axis = Eigen::Vector3d::UnitZ().cross(direction);
      state.q_WB = Eigen::AngleAxisd(45 * kDegree, axis);
      Fallback fallback(model);
      const Flight flight = fly(&fallback, model, state, 10s, 3s);
      EXPECT_LT(flight.end.v_WB.norm(), 0.3) << heading;
      EXPECT_LT(tilt_rad(flight.end), 5 * kDegree) << heading;
      EXPECT_LT(flight.end.w_WB_B.norm(), 0.2) << heading;
      EXPECT_LT(flight.level_after_s, 0.8) << heading;
      EXPECT_GT(flight.lowest_m, 5 - 0.8) << heading;
      EXPECT_LT(flight.highest_m, 5 + 0.8) << heading;
      EXPECT_LT(flight.farthest_m, 6.0) << heading;
      EXPECT_NEAR(flight.end.p_WB.z(), 5, 0.3) << heading;
    }
  }
}

TEST(Fallback, StopsFromSevenMetresPerSecondWithinFourMetres) {
  const QuadrotorModel model;
  QuadrotorState state = hovering(model);
  state.v_WB.x() = 7.0;
  Fallback fallback(model);
  const Flight flight = fly(&fallback, model, state, 10s, 3s);
  EXPECT_LT(flight.farthest_m, 4.0);
  EXPECT_LT(flight.end.v_WB.norm(), 0.3);
  EXPECT_GT(flight.lowest_m, 5 - 0.8);
}

/// A course of one gate so far ahead of hovering().
Course gate_at(double ahead_m) {
  Course course;
  course.waypoints.emplace_back(Eigen::Vector3d(1 + ahead_m, 2, 5), Eigen::Vector3d::UnitX());
  course.closed = false;
  return course;
}

TEST(Fallback, APlanThroughAGateThatIsTooNearToStopIsFlownToItsEnd) {
  const QuadrotorModel model;
  QuadrotorState state = hovering(model);
  state.v_WB.x() = 7.0;
  const auto begins = [&](double gate_m) {
    return Fallback(model, {}, KeepClear(gate_at(gate_m), 0.5)).better_than_plan(state, 280ms);
  };
  EXPECT_FALSE(begins(1.5)) << "the plan passes it";
  EXPECT_FALSE(begins(2.8)) << "the plan doesn't, but braking would end in it";
  EXPECT_TRUE(begins(5.0));
  EXPECT_FALSE(Fallback(model).better_than_plan(state, 280ms)) << "who knows no course flies what there is";
}

TEST(Fallback, StopsBeforeAGateThatIsFarEnoughAndDriftsOutOfOneThatIsNot) {
  const QuadrotorModel model;
  QuadrotorState state = hovering(model);
  state.v_WB.x() = 7.0;
  Fallback before(model, {}, KeepClear(gate_at(5.0), 0.5));
  EXPECT_LT(fly(&before, model, state, 10s, 3s).end.p_WB.x() - 1, 5.0 - 0.5);
  Fallback within(model, {}, KeepClear(gate_at(3.5), 0.5));
  const double end_m = fly(&within, model, state, 10s, 3s).end.p_WB.x() - 1;
  EXPECT_GT(std::abs(end_m - 3.5), 0.5) << "nobody hovers in a gate";
}

TEST(Fallback, DescendsAfterTheHold) {
  const QuadrotorModel model;
  Fallback fallback(model);
  const Flight held = fly(&fallback, model, hovering(model), 0s, 3s);
  const Flight sunk = fly(&fallback, model, held.end, 3s, 4s);
  EXPECT_NEAR(sunk.end.v_WB.z(), -Fallback::kDescent_m_s, 0.05);
  EXPECT_NEAR(sunk.end.p_WB.z(), 5 - 4 * Fallback::kDescent_m_s, 0.3);
  EXPECT_LT(sunk.farthest_m, 0.01);
}

TEST(Fallback, BeginsAnewAfterAPlan) {
  const QuadrotorModel model;
  Fallback fallback(model);
  fly(&fallback, model, hovering(model), 0s, 6s);  // sinking by now
  fallback.reset();
  const Flight flight = fly(&fallback, model, hovering(model), 6s, 2s);
  EXPECT_NEAR(flight.end.p_WB.z(), 5, 0.01);
}

TEST(Fallback, AClockThatBeginsAnewDoesNotKeepItFromDescending) {
  const QuadrotorModel model;
  Fallback fallback(model);
  const Flight held = fly(&fallback, model, hovering(model), 1000s, 1s);
  const Flight sunk = fly(&fallback, model, held.end, 0s, 7s);
  EXPECT_NEAR(sunk.end.p_WB.z(), 5 - 4 * Fallback::kDescent_m_s, 0.3);
}

TEST(Fallback, RecoversFromRacingAttitudesAndRates) {
  // What a racing drone may be in when the link breaks: up to 80 deg of tilt, 4 rad/s, 8 m/s, turning hard.
  const QuadrotorModel model;
  Random random(5);
  for (int trial = 0; trial < 40; ++trial) {
    QuadrotorState state = hovering(model);
    const double heading = random.uniform(-std::numbers::pi, std::numbers::pi);
    const Eigen::Vector3d axis(std::cos(heading), std::sin(heading), 0);
    state.q_WB = Eigen::AngleAxisd(random.uniform(-std::numbers::pi, std::numbers::pi), Eigen::Vector3d::UnitZ()) *
                 Eigen::AngleAxisd(random.uniform(0, 80 * kDegree), axis);
    state.v_WB =
        Eigen::Vector3d(random.normal(), random.normal(), 0.3 * random.normal()).normalized() * random.uniform(0, 8);
    state.w_WB_B = Eigen::Vector3d(random.uniform(-4, 4), random.uniform(-4, 4), random.uniform(-2, 2));
    const double common_n = random.uniform(1, 5);
    for (int i = 0; i < 4; ++i) state.thrust_n[i] = state.thrust_command_n[i] = common_n + random.uniform(-0.5, 0.5);
    Fallback fallback(model);
    const Flight flight = fly(&fallback, model, state, 0s, 3s);
    EXPECT_LT(flight.end.v_WB.norm(), 0.8) << "trial " << trial;
    EXPECT_LT(tilt_rad(flight.end), 10 * kDegree) << "trial " << trial;
    EXPECT_GT(flight.lowest_m, 2.0) << "trial " << trial;
  }
}

TEST(Fallback, ComesBackFromUpsideDown) {
  const QuadrotorModel model;
  QuadrotorState state = hovering(model);
  state.p_WB.z() = 30;
  state.q_WB = Eigen::Quaterniond(0, 0, 1, 0);  // half a turn about y, exactly
  Fallback fallback(model);
  const Flight flight = fly(&fallback, model, state, 0s, 3s);
  EXPECT_LT(tilt_rad(flight.end), 10 * kDegree);
  EXPECT_LT(flight.level_after_s, 1.0);
  EXPECT_LT(flight.end.v_WB.norm(), 2.0);
}

TEST(Fallback, WorksWithOtherVehiclesAndSlowRotors) {
  const QuadrotorModel standard;
  for (const double scale : {0.4, 2.5}) {
    for (const double lag_s : {0.01, 0.025, 0.05}) {
      QuadrotorModel model = standard;
      model.mass_kg *= scale;
      model.inertia_kg_m2 *= std::pow(scale, 5.0 / 3.0);
      for (auto& position : model.rotor_position_B_m) position *= std::cbrt(scale);
      model.thrust_max_n *= scale;
      model.thrust_rate_max_n_s *= scale;
      model.rotor_time_constant_s = lag_s;
      ASSERT_TRUE(validate(model).ok()) << validate(model).error();
      QuadrotorState state = hovering(model);
      state.v_WB = {4, -4, 0};
      state.q_WB = Eigen::AngleAxisd(45 * kDegree, Eigen::Vector3d(1, 1, 0).normalized());
      Fallback fallback(model);
      const Flight flight = fly(&fallback, model, state, 0s, 3s);
      EXPECT_LT(flight.end.v_WB.norm(), 0.9) << scale << " " << lag_s;
      EXPECT_LT(tilt_rad(flight.end), 10 * kDegree) << scale << " " << lag_s;
      EXPECT_GT(flight.lowest_m, 2.5) << scale << " " << lag_s;
    }
  }
}

TEST(Fallback, IsCalledRarelyAndStillHolds) {
  const QuadrotorModel model;
  QuadrotorState state = hovering(model);
  state.v_WB = {3, 0, 0};
  Fallback fallback(model);
  const Flight flight = fly(&fallback, model, state, 0s, 3s, 10ms);  // 100 Hz
  EXPECT_LT(flight.end.v_WB.norm(), 0.3);
  EXPECT_NEAR(flight.end.p_WB.z(), 5, 0.2);
}

Actuation by_rates() {
  Actuation actuation;
  actuation.kind = Actuation::Kind::kBodyRates;
  actuation.thrust_time_constant_s = 0.025;
  actuation.rate_time_constant_s = Eigen::Vector3d(0.042, 0.042, 0.08);
  return actuation;
}

// A flight controller as its lags say.
Flight fly_by_rates(Fallback* fallback, const QuadrotorModel& model, QuadrotorState state, Stamp length) {
  const Actuation lags = by_rates();
  Flight flight;
  double collective_n = model.mass_kg * kGravity_m_s2;
  const Eigen::Vector3d start = state.p_WB;
  const double h = 1e-3;
  for (Stamp now{0}; now < length; now += 1ms) {
    QuadrotorState told = state;
    told.thrust_n.setConstant(NAN);
    told.thrust_command_n.setConstant(NAN);
    const Setpoint setpoint = fallback->update(now, told);
    EXPECT_TRUE(setpoint.rotor_thrust_n.isZero(0) && setpoint.thrust_rate_n_s.isZero(0));
    EXPECT_GE(setpoint.collective_thrust_n,
              std::min(0.1 * kRotors * model.thrust_max_n, 0.5 * model.mass_kg * kGravity_m_s2));
    EXPECT_LE(setpoint.collective_thrust_n, kRotors * model.thrust_max_n);
    EXPECT_LE((setpoint.body_rates_rad_s.cwiseAbs() - model.body_rate_max_rad_s).maxCoeff(), 1e-9);
    collective_n += h / lags.thrust_time_constant_s * (setpoint.collective_thrust_n - collective_n);
    state.w_WB_B +=
        h * (setpoint.body_rates_rad_s - state.w_WB_B).cwiseQuotient(Eigen::Vector3d(lags.rate_time_constant_s));
    const double angle = h * state.w_WB_B.norm();
    if (angle > 0) state.q_WB = (state.q_WB * Eigen::AngleAxisd(angle, state.w_WB_B.normalized())).normalized();
    const Eigen::Matrix3d R_WB = state.q_WB.toRotationMatrix();
    const Eigen::Vector3d a_W =
        (collective_n * R_WB.col(2) - R_WB * model.drag_kg_s.cwiseProduct(R_WB.transpose() * state.v_WB)) /
            model.mass_kg -
        Eigen::Vector3d(0, 0, kGravity_m_s2);
    state.v_WB += h * a_W;
    state.p_WB += h * state.v_WB;
    flight.lowest_m = std::min(flight.lowest_m, state.p_WB.z());
    flight.farthest_m = std::max(flight.farthest_m, (state.p_WB - start).head<2>().norm());
    if (tilt_rad(state) > 35 * kDegree) flight.level_after_s = seconds(now);
  }
  flight.end = state;
  return flight;
}

TEST(Fallback, AVehicleDrivenByBodyRatesBrakesHoldsAndDescendsWithoutAWordOfItsRotors) {
  QuadrotorModel model;
  model.body_rate_max_rad_s = {4, 4, 2};
  for (int heading = 0; heading < 360; heading += 45) {
    const Eigen::Vector3d direction(std::cos(heading * kDegree), std::sin(heading * kDegree), 0);
    QuadrotorState state = hovering(model);
    state.v_WB = 6.0 * direction;
    state.q_WB = Eigen::AngleAxisd(45 * kDegree, Eigen::Vector3d::UnitZ().cross(direction));
    Fallback fallback(model, by_rates());
    const Flight braked = fly_by_rates(&fallback, model, state, 3s);
    EXPECT_LT(braked.end.v_WB.norm(), 0.3) << heading;
    EXPECT_LT(tilt_rad(braked.end), 5 * kDegree) << heading;
    EXPECT_LT(braked.farthest_m, 6.0) << heading;
    EXPECT_NEAR(braked.end.p_WB.z(), 5, 0.3) << heading;

    Fallback longer(model, by_rates());
    const Flight sunk = fly_by_rates(&longer, model, state, 7s);
    EXPECT_NEAR(sunk.end.v_WB.z(), -Fallback::kDescent_m_s, 0.05) << heading;
  }
}

TEST(Fallback, AVehicleTenTimesAsStrongAsItIsHeavySinksToo) {
  QuadrotorModel model;
  model.thrust_max_n = 10 * model.mass_kg * kGravity_m_s2 / kRotors;
  Fallback fallback(model, by_rates());
  const Flight flight = fly_by_rates(&fallback, model, hovering(model), 7s);
  EXPECT_NEAR(flight.end.v_WB.z(), -Fallback::kDescent_m_s, 0.05);
}

TEST(Fallback, AVehicleDrivenByBodyRatesComesBackFromUpsideDown) {
  QuadrotorModel model;
  model.body_rate_max_rad_s = {6, 6, 3};
  QuadrotorState state = hovering(model);
  state.p_WB.z() = 30;
  state.q_WB = Eigen::Quaterniond(0, 0, 1, 0);
  Fallback fallback(model, by_rates());
  const Flight flight = fly_by_rates(&fallback, model, state, 3s);
  EXPECT_LT(tilt_rad(flight.end), 10 * kDegree);
  EXPECT_LT(flight.level_after_s, 1.2);
}

}  // namespace
}  // namespace gatefield::sdk
