#include "client/flight/manoeuvres.h"

#include <gtest/gtest.h>

#include <functional>
#include <numbers>
#include <string>
#include <tuple>

#include "tests/support/allocation_trap.h"
#include "tests/unit/client/flight/rate_vehicle.h"

namespace gatefield::flight {
namespace {

using namespace std::chrono_literals;

constexpr double kDegree = std::numbers::pi / 180.0;

Course gate_at(const Eigen::Vector3d& p_W) {
  Course course;
  course.waypoints.emplace_back(p_W, Eigen::Vector3d(1, 0, 0));
  course.closed = false;
  return course;
}
Course far_away() { return gate_at({0, 0, 500}); }

/// A vehicle that is in one phase, whatever comes.
class Flown {
 public:
  explicit Flown(const Course& course = far_away(), const QuadrotorModel& model = {})
      : manoeuvres_(model, RateVehicle::actuation(), course, options) {
    vehicle.model = model;
  }

  SupervisorOptions options;
  RateVehicle vehicle;
  Stamp now = 10s;
  sdk::Setpoint plan;
  bool controller_tells_attitude = false, states_come = true;
  sdk::Setpoint last;

  void enter(Phase phase) {
    directive_.phase = phase;
    directive_.since = now;
  }
  void fly(Stamp span) {
    for (const Stamp end = now + span; now < end; now += 5ms) {
      if (states_come) state_ = TimedState{.stamp = now, .state = vehicle.state};
      ControllerStatus controller;
      if (controller_tells_attitude) controller.q_WB = vehicle.state.q_WB;
      const auto setpoint = manoeuvres_.setpoint(directive_, now, state_, controller, plan);
      ASSERT_TRUE(setpoint);
      last = *setpoint;
      EXPECT_TRUE(std::isfinite(last.collective_thrust_n) && last.body_rates_rad_s.allFinite());
      for (int i = 0; i < 5; ++i) vehicle.step(last.collective_thrust_n, last.body_rates_rad_s, 1e-3);
      if (watch) watch();
    }
  }
  std::function<void()> watch;
  std::optional<sdk::Setpoint> ask() { return manoeuvres_.setpoint(directive_, now, state_, {}, plan); }
  Manoeuvres& manoeuvres() { return manoeuvres_; }

 private:
  Manoeuvres manoeuvres_;
  Directive directive_;
  std::optional<TimedState> state_;
};

TEST(Manoeuvres, NothingIsAppliedOnTheGroundOrInOtherHands) {
  Flown flown;
  flown.vehicle.hover_at({0, 0, 1});
  flown.enter(Phase::kHolding);
  flown.fly(10ms);
  for (const Phase phase :
       {Phase::kDisarmed, Phase::kReady, Phase::kArming, Phase::kYielded, Phase::kLanded, Phase::kKilled}) {
    flown.enter(phase);
    EXPECT_FALSE(flown.ask()) << name(phase);
  }
}

TEST(Manoeuvres, TakesOffToItsHeightAndHovers) {
  Flown flown;
  flown.enter(Phase::kTakeOff);
  double highest = 0;
  flown.watch = [&] { highest = std::max(highest, flown.vehicle.state.p_WB.z()); };
  flown.fly(5s);
  EXPECT_NEAR(flown.vehicle.state.p_WB.z(), flown.options.take_off_height_m, 0.08);
  EXPECT_LT(highest, flown.options.take_off_height_m + 0.25);
  flown.enter(Phase::kHolding);
  flown.fly(3s);
  EXPECT_LT(flown.vehicle.state.v_WB.norm(), 0.05);
}

TEST(Manoeuvres, AVehicleThatIsHeldOnTheGroundDoesNotJumpUpWhenLetGo) {
  Flown flown;
  flown.enter(Phase::kTakeOff);
  flown.watch = [&] {
    if (flown.now < 14s) flown.vehicle.hover_at({0, 0, 0});
  };
  flown.fly(4s);
  double fastest = 0;
  flown.watch = [&] { fastest = std::max(fastest, flown.vehicle.state.v_WB.z()); };
  flown.fly(2s);
  EXPECT_LT(fastest, 2.0);
}

TEST(Manoeuvres, BrakesThenHoldsItsPlaceThenSinks) {
  Flown flown;
  flown.vehicle.hover_at({0, 0, 3});
  flown.vehicle.state.v_WB = {8, 2, 0};
  flown.vehicle.state.q_WB = Eigen::AngleAxisd(45 * kDegree, Eigen::Vector3d::UnitY());
  flown.enter(Phase::kBraking);
  flown.fly(3s);
  EXPECT_LT(flown.vehicle.state.v_WB.norm(), 0.5);
  EXPECT_LT(flown.vehicle.tilt_rad(), 8 * kDegree);
  EXPECT_NEAR(flown.vehicle.state.p_WB.z(), 3, 0.5);
  flown.enter(Phase::kHolding);
  const Eigen::Vector3d home = flown.vehicle.state.p_WB;
  flown.fly(5s);
  EXPECT_LT((flown.vehicle.state.p_WB - home).norm(), 0.4);
  flown.enter(Phase::kDescending);
  flown.fly(3s);
  EXPECT_NEAR(flown.vehicle.state.v_WB.z(), -flown.options.descent_m_s, 0.1);
  flown.fly(12s);
  EXPECT_TRUE(flown.vehicle.on_ground());
  EXPECT_LT(flown.vehicle.hardest_touch_m_s, 0.8);
  EXPECT_LT((flown.vehicle.state.p_WB - home).head<2>().norm(), 0.5);
  EXPECT_LT(flown.last.collective_thrust_n, 0.65 * flown.vehicle.model.mass_kg * kGravity_m_s2)
      << "on the ground it is let sink";
}

TEST(Manoeuvres, AVehicleTwelveTimesAsStrongAsItIsHeavySinksToo) {
  QuadrotorModel strong;
  strong.thrust_max_n = 12 * strong.mass_kg * kGravity_m_s2 / kRotors;
  for (const Phase phase : {Phase::kDescending, Phase::kLevelDescent}) {
    Flown flown(far_away(), strong);
    flown.vehicle.hover_at({0, 0, 1.5});
    flown.enter(phase);
    flown.fly(5s);
    EXPECT_TRUE(flown.vehicle.on_ground()) << name(phase) << " at " << flown.vehicle.state.p_WB.z();
    EXPECT_LT(flown.vehicle.hardest_touch_m_s, 2.0) << name(phase);
  }
}

TEST(Manoeuvres, TheHandOverBeginsAsTheLawAndEndsAsThePlan) {
  Flown flown;
  flown.vehicle.hover_at({0, 0, 1});
  flown.plan.source = sdk::Setpoint::Source::kPlan;
  flown.plan.collective_thrust_n = 12;
  flown.plan.body_rates_rad_s = {0, 3, 0};
  flown.plan.rotor_thrust_n.setConstant(3);
  flown.enter(Phase::kHolding);
  flown.fly(1s);
  const sdk::Setpoint held = flown.last;
  flown.enter(Phase::kHandOver);
  const auto begin = flown.ask();
  EXPECT_NEAR(begin->collective_thrust_n, held.collective_thrust_n, 0.1);
  EXPECT_NEAR(begin->body_rates_rad_s.norm(), held.body_rates_rad_s.norm(), 0.05);
  flown.now += flown.options.hand_over / 2;
  EXPECT_NEAR(flown.ask()->body_rates_rad_s.y(), 1.5, 0.1);
  flown.now += flown.options.hand_over / 2;
  const auto end = flown.ask();
  EXPECT_EQ(end->collective_thrust_n, 12);
  EXPECT_EQ(end->body_rates_rad_s, flown.plan.body_rates_rad_s);
  EXPECT_EQ(end->rotor_thrust_n, flown.plan.rotor_thrust_n);
  flown.enter(Phase::kRacing);
  EXPECT_EQ(flown.ask()->body_rates_rad_s, flown.plan.body_rates_rad_s);
}

// ---- without a state
// -----------------------------------------------------------------------------------------------------------

struct Blind {
  const char* name;
  double height_m;
  Eigen::Vector3d v_W;
  double tilt_deg;
  double thrust_factor;
};

class LevelDescent : public testing::TestWithParam<std::tuple<Blind, bool>> {};

TEST_P(LevelDescent, EndsLevelOnTheGroundAtASpeedThatLegsTake) {
  const auto& [blind, attitude] = GetParam();
  Flown flown;
  flown.vehicle.hover_at({0, 0, blind.height_m});
  flown.vehicle.thrust_factor = blind.thrust_factor;
  flown.vehicle.state.v_WB = blind.v_W;
  flown.vehicle.state.q_WB = Eigen::AngleAxisd(blind.tilt_deg * kDegree, Eigen::Vector3d(1, 1, 0).normalized());
  flown.controller_tells_attitude = attitude;
  flown.enter(Phase::kRacing);
  flown.plan.collective_thrust_n = flown.vehicle.thrust_n;
  flown.fly(10ms);
  flown.states_come = false;
  flown.enter(Phase::kLevelDescent);
  flown.fly(1s);
  if (!flown.vehicle.on_ground()) {
    EXPECT_LT(flown.vehicle.tilt_rad(), 12 * kDegree);
  }
  for (int i = 0; i < 50 && !flown.vehicle.on_ground(); ++i) flown.fly(100ms);
  EXPECT_TRUE(flown.vehicle.on_ground());
  EXPECT_LT(flown.vehicle.hardest_touch_m_s, 3.5);
}

INSTANTIATE_TEST_SUITE_P(
    Manoeuvres, LevelDescent,
    testing::Combine(testing::Values(Blind{"hover", 1.5, {0, 0, 0}, 0, 1.0}, Blind{"race", 2.0, {6, 0, 0}, 45, 1.0},
                                     Blind{"climb", 2.0, {3, 0, 2}, 30, 1.0}, Blind{"dive", 4.0, {4, 0, -3}, 30, 1.0},
                                     Blind{"strong", 1.5, {3, 0, 0}, 20, 1.05},
                                     Blind{"weak", 1.5, {3, 0, 0}, 20, 0.93}),
                     testing::Bool()),
    [](const auto& test) {
      return std::string(std::get<0>(test.param).name) +
             (std::get<1>(test.param) ? "_attitude_told" : "_attitude_reckoned");
    });

// ---- gates
// ---------------------------------------------------------------------------------------------------------------------

/// Brakes towards a gate at x = 0 and says how far from its frame the vehicle's sphere came: below 0 it hit.
double clearance(const Course& course, double aside_m, double speed_m_s, double from_m) {
  Flown flown(course);
  flown.vehicle.hover_at({-from_m, aside_m, 1.5});
  flown.vehicle.state.v_WB = {speed_m_s, 0, 0};
  flown.enter(Phase::kBraking);
  double nearest = 10.0;
  const GateShape gate;
  flown.watch = [&] {
    const Eigen::Vector3d& p = flown.vehicle.state.p_WB;
    const double radius = std::max(std::abs(p.y()), std::abs(p.z() - 1.5));
    const double from_frame = std::max({radius - gate.outer_half_m, gate.inner_half_m - radius});
    nearest = std::min(nearest, std::hypot(p.x(), std::max(0.0, from_frame)) - flown.vehicle.model.collision_radius_m);
  };
  flown.fly(4s);
  return nearest;
}

TEST(Manoeuvres, AnAttitudeOfTheControllerThatIsNoneIsReckonedInstead) {
  Manoeuvres manoeuvres({}, RateVehicle::actuation(), far_away(), {});
  Directive directive;
  directive.phase = Phase::kLevelDescent;
  directive.since = 10s;
  TimedState state{.stamp = 10s, .state = {}};
  state.state.q_WB = Eigen::AngleAxisd(30 * kDegree, Eigen::Vector3d::UnitX());
  ControllerStatus controller;
  controller.q_WB = PlainQuaternion(Eigen::Quaterniond(std::nan(""), 0, 0, 0));
  for (Stamp now = 10s; now < 11s; now += 5ms) {
    const auto setpoint = manoeuvres.setpoint(directive, now, state, controller, {});
    ASSERT_TRUE(setpoint && setpoint->body_rates_rad_s.allFinite() && std::isfinite(setpoint->collective_thrust_n));
    if (now == 10s) {
      EXPECT_LT(setpoint->body_rates_rad_s.x(), -0.5) << "it levels out";
    }
  }
}

TEST(Manoeuvres, BrakingKeepsClearOfTheFrameAhead) {
  for (const double aside : {-0.85, -0.7, -0.5, 0.5, 0.7, 0.85}) {
    EXPECT_LT(clearance(far_away(), aside, 7, 4), 0.0) << "without knowing of it the frame would be hit";
    EXPECT_GT(clearance(gate_at({0, 0, 1.5}), aside, 7, 4), 0.05) << aside;
  }
  EXPECT_GT(clearance(gate_at({0, 0, 1.5}), 0.0, 7, 4), 0.2) << "through the middle as it was";
}

TEST(Manoeuvres, NothingHoversOrSinksInAGate) {
  for (const double x : {-0.3, 0.05, 0.3}) {
    Flown flown(gate_at({0, 0, 1.5}));
    flown.vehicle.hover_at({x, 0.3, 1.6});
    flown.enter(Phase::kHolding);
    double lowest_inside = 2.0;
    const double space = flown.vehicle.model.collision_radius_m + 0.2;
    flown.watch = [&] {
      const Eigen::Vector3d& p = flown.vehicle.state.p_WB;
      if (std::abs(p.x()) < space && std::abs(p.y()) < 1) lowest_inside = std::min(lowest_inside, p.z());
    };
    flown.enter(Phase::kDescending);
    flown.fly(12s);
    EXPECT_GT(std::abs(flown.vehicle.state.p_WB.x()), space) << x;
    EXPECT_EQ(std::signbit(flown.vehicle.state.p_WB.x()), std::signbit(x)) << "out on its own side";
    EXPECT_GT(lowest_inside, 1.3) << x;
    EXPECT_TRUE(flown.vehicle.on_ground());
  }
}

TEST(Manoeuvres, AllocateNothing) {
  Flown flown(gate_at({0, 0, 1.5}));
  flown.vehicle.hover_at({-3, 0.6, 1.6});
  flown.vehicle.state.v_WB = {5, 0, 0};
  const test::AllocationTrap trap;
  for (const Phase phase :
       {Phase::kBraking, Phase::kHolding, Phase::kHandOver, Phase::kRacing, Phase::kDescending, Phase::kLevelDescent}) {
    flown.enter(phase);
    flown.fly(100ms);
  }
  EXPECT_EQ(trap.count(), 0u);
}

}  // namespace
}  // namespace gatefield::flight
