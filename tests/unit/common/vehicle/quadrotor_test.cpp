#include "common/vehicle/quadrotor.h"

#include <gmock/gmock.h>

#include <cmath>
#include <functional>
#include <limits>
#include <string>

namespace gatefield {
namespace {

using testing::HasSubstr;
using Step = std::function<QuadrotorState(const QuadrotorModel&, const QuadrotorState&, const ThrustRates&, double)>;

// The default layout.
constexpr int kFrontRight = 0, kRearLeft = 1, kFrontLeft = 2, kRearRight = 3;

QuadrotorState hovering(const QuadrotorModel& model) {
  QuadrotorState state;
  state.p_WB = {1, -2, 3};
  state.thrust_n = state.thrust_command_n = hover_thrust_n(model);
  return state;
}

/// Fast, tilted and turning, with rotors that lag behind what they are asked for.
QuadrotorState racing() {
  QuadrotorState state;
  state.v_WB = {6, -3, 1};
  state.q_WB = Eigen::Quaterniond(Eigen::AngleAxisd(0.8, Eigen::Vector3d(0.5, -0.6, 0.3).normalized()));
  state.w_WB_B = {3, -4, 2};
  state.thrust_n = {2.0, 3.0, 2.5, 1.5};
  state.thrust_command_n = {2.4, 2.8, 2.9, 1.2};
  return state;
}

QuadrotorState simulate(const Step& step, const QuadrotorModel& model, QuadrotorState state, const ThrustRates& u,
                        double duration_s, int steps) {
  for (int i = 0; i < steps; ++i) state = step(model, state, u, duration_s / steps);
  return state;
}

double difference(const QuadrotorState& a, const QuadrotorState& b) {
  return (a.p_WB - b.p_WB).norm() + (a.v_WB - b.v_WB).norm() + a.q_WB.angularDistance(b.q_WB) +
         (a.w_WB_B - b.w_WB_B).norm();
}

class EveryStep : public testing::TestWithParam<int> {
 protected:
  Step step_ = GetParam() == 0 ? Step(step_reference) : Step(step_planner);
};

TEST_P(EveryStep, HoverIsAnEquilibrium) {
  const QuadrotorModel model;
  const QuadrotorState start = hovering(model);
  const QuadrotorState end = simulate(step_, model, start, ThrustRates::Zero(), 3.0, 100);
  EXPECT_LT(difference(start, end), 1e-9);
  EXPECT_LT((end.thrust_n - start.thrust_n).norm(), 1e-12);
}

TEST_P(EveryStep, FallsFreelyWithoutThrustAndDrag) {
  QuadrotorModel model;
  model.drag_kg_s.setZero();
  QuadrotorState start;
  start.v_WB = {2, 0, 1};
  const QuadrotorState end = simulate(step_, model, start, ThrustRates::Zero(), 0.6, 20);
  EXPECT_NEAR(end.p_WB.x(), 1.2, 1e-9);
  EXPECT_NEAR(end.p_WB.z(), 0.6 - 0.5 * kGravity_m_s2 * 0.36, 1e-9);
  EXPECT_NEAR(end.v_WB.z(), 1 - kGravity_m_s2 * 0.6, 1e-9);
  EXPECT_EQ(end.q_WB.coeffs(), Eigen::Quaterniond::Identity().coeffs());
}

TEST_P(EveryStep, DragSlowsAlongTheBodyAxes) {
  QuadrotorModel model;
  model.drag_kg_s = {0.4, 0.0, 0.0};
  QuadrotorState start = hovering(model);
  start.q_WB = Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitZ());  // body x along world y
  start.v_WB = {5, 5, 0};
  const QuadrotorState end = simulate(step_, model, start, ThrustRates::Zero(), 1.0, 1000);
  EXPECT_NEAR(end.v_WB.x(), 5.0, 1e-6);
  EXPECT_NEAR(end.v_WB.y(), 5.0 * std::exp(-0.4 / model.mass_kg), 2e-3);
}

TEST_P(EveryStep, SymmetricThrustKeepsLevelAndClimbs) {
  const QuadrotorModel model;
  const QuadrotorState end = simulate(step_, model, hovering(model), ThrustRates::Constant(5.0), 0.6, 20);
  EXPECT_GT(end.p_WB.z(), 3.5);
  EXPECT_LT(end.q_WB.angularDistance(Eigen::Quaterniond::Identity()), 1e-9);
  EXPECT_NEAR(end.thrust_command_n[0], hover_thrust_n(model)[0] + 3.0, 1e-9);
}

TEST_P(EveryStep, MoreThrustOnTheLeftRollsRight) {
  ThrustRates u = ThrustRates::Zero();
  u[kFrontLeft] = u[kRearLeft] = 5.0;
  const QuadrotorModel model;
  const QuadrotorState end = simulate(step_, model, hovering(model), u, 0.2, 20);
  EXPECT_GT(end.w_WB_B.x(), 0.1) << "x forward, y left, z up: rolling right is positive about x";
  EXPECT_NEAR(end.w_WB_B.y(), 0.0, 1e-9);
  EXPECT_LT(end.v_WB.y(), 0.0) << "and takes the vehicle to the right";
}

TEST_P(EveryStep, MoreThrustInTheRearPitchesForward) {
  ThrustRates u = ThrustRates::Zero();
  u[kRearLeft] = u[kRearRight] = 5.0;
  const QuadrotorModel model;
  const QuadrotorState end = simulate(step_, model, hovering(model), u, 0.2, 20);
  EXPECT_GT(end.w_WB_B.y(), 0.1) << "nose down is positive about y";
  EXPECT_GT(end.v_WB.x(), 0.0) << "and takes the vehicle forward";
}

TEST_P(EveryStep, ReactionTorqueYaws) {
  const QuadrotorModel model;
  ThrustRates u = ThrustRates::Constant(-5.0);
  u[kFrontRight] = u[kRearLeft] = 5.0;  // the pair with spin +1
  const QuadrotorState end = simulate(step_, model, hovering(model), u, 0.2, 20);
  EXPECT_GT(end.w_WB_B.z(), 0.1);
  EXPECT_NEAR(end.w_WB_B.head<2>().norm(), 0.0, 1e-9);
}

TEST_P(EveryStep, FreeRotationKeepsTheAngularMomentumInTheWorld) {
  QuadrotorModel model;
  model.inertia_kg_m2 = {2e-3, 3e-3, 5e-3};
  model.drag_kg_s.setZero();
  QuadrotorState start;
  start.w_WB_B = {5, 2, -3};
  const auto momentum_W = [&](const QuadrotorState& s) {
    return Eigen::Vector3d(s.q_WB * model.inertia_kg_m2.cwiseProduct(s.w_WB_B));
  };
  const QuadrotorState end = simulate(step_, model, start, ThrustRates::Zero(), 0.5, 20000);
  EXPECT_LT((momentum_W(end) - momentum_W(start)).norm(), 1e-3 * momentum_W(start).norm());
  EXPECT_GT((end.w_WB_B - start.w_WB_B).norm(), 0.5) << "the rates themselves do change";
}

TEST_P(EveryStep, KeepsTheQuaternionNormal) {
  const QuadrotorState end = simulate(step_, QuadrotorModel{}, racing(), {10, -10, 5, -5}, 2.0, 100);
  EXPECT_NEAR(end.q_WB.norm(), 1.0, 1e-12);
}

INSTANTIATE_TEST_SUITE_P(, EveryStep, testing::Values(0, 1),
                         [](const auto& test) { return std::string(test.param == 0 ? "Reference" : "Planner"); });

TEST(StepReference, ConvergesWithTheFourthOrder) {
  const QuadrotorModel model;
  const ThrustRates u(8, -6, 4, -3);  // stays off the limits, whose kinks would hide the order
  const QuadrotorState truth = simulate(step_reference, model, racing(), u, 0.3, 3000);
  const double coarse = difference(simulate(step_reference, model, racing(), u, 0.3, 10), truth);
  const double fine = difference(simulate(step_reference, model, racing(), u, 0.3, 20), truth);
  EXPECT_NEAR(std::log2(coarse / fine), 4.0, 0.5);
}

TEST(StepPlanner, ConvergesToTheReferenceAsTheStepShrinks) {
  const QuadrotorModel model;
  const ThrustRates u(8, -6, 4, -3);  // stays off the limits, whose kinks would hide the order
  const QuadrotorState truth = simulate(step_reference, model, racing(), u, 0.3, 3000);
  const double coarse = difference(simulate(step_planner, model, racing(), u, 0.3, 20), truth);
  double last = coarse;
  for (const int steps : {40, 80, 160, 320}) {
    const double now = difference(simulate(step_planner, model, racing(), u, 0.3, steps), truth);
    // Drag and the gyroscopic term at the old values make it first order; it must not be less.
    EXPECT_GT(std::log2(last / now), 0.9) << steps;
    last = now;
  }
  EXPECT_LT(last, coarse / 14);
}

TEST(StepPlanner, StaysWithinCentimetresAtTheControllersStep) {
  const QuadrotorModel model;
  QuadrotorState start = hovering(model);
  start.w_WB_B = {4, 4, 2};  // 6 rad/s
  start.v_WB = {6, 0, 0};
  const QuadrotorState planned = simulate(step_planner, model, start, ThrustRates::Zero(), 0.6, 20);
  const QuadrotorState truth = simulate(step_reference, model, start, ThrustRates::Zero(), 0.6, 600);
  EXPECT_LT((planned.p_WB - truth.p_WB).norm(), 0.05);
}

TEST(StepRotors, AgreesWithFineIntegration) {
  const QuadrotorModel model;
  for (const double rate : {-25.0, -3.0, 0.0, 10.0, 30.0}) {
    QuadrotorState exact = racing();
    exact.thrust_command_n = Eigen::Vector4d(4, 5, 3, 6);  // far from the limits
    exact.thrust_n = Eigen::Vector4d(3, 6, 3, 2);
    Eigen::Vector4d thrust = exact.thrust_n, command = exact.thrust_command_n;
    constexpr int kFine = 200000;
    constexpr double kDt_s = 0.03;
    for (int i = 0; i < kFine; ++i) {
      const double h = kDt_s / kFine;
      const Eigen::Vector4d middle = command + Eigen::Vector4d::Constant(0.5 * rate * h);
      thrust += h / model.rotor_time_constant_s * (middle - thrust);
      command += Eigen::Vector4d::Constant(rate * h);
    }
    step_rotors(model, ThrustRates::Constant(rate), kDt_s, &exact);
    EXPECT_LT((exact.thrust_n - thrust).norm(), 1e-5) << rate;
    EXPECT_LT((exact.thrust_command_n - command).norm(), 1e-9) << rate;
  }
}

TEST(StepRotors, OneLongStepEqualsManyShortOnes) {
  const QuadrotorModel model;
  QuadrotorState one = racing(), many = one;
  step_rotors(model, {5, -5, 10, 3}, 0.06, &one);
  for (int i = 0; i < 6; ++i) step_rotors(model, {5, -5, 10, 3}, 0.01, &many);
  EXPECT_LT((one.thrust_n - many.thrust_n).norm(), 1e-12);
  EXPECT_LT((one.thrust_command_n - many.thrust_command_n).norm(), 1e-12);
}

TEST(StepRotors, CommandStopsAtRateAndThrustLimits) {
  const QuadrotorModel model;
  QuadrotorState state;
  state.thrust_n = state.thrust_command_n = Eigen::Vector4d(9.9, 0.1, 5, 5);
  step_rotors(model, {20, -20, 1000, -1000}, 0.03, &state);
  EXPECT_DOUBLE_EQ(state.thrust_command_n[0], model.thrust_max_n);
  EXPECT_DOUBLE_EQ(state.thrust_command_n[1], model.thrust_min_n);
  EXPECT_DOUBLE_EQ(state.thrust_command_n[2], 5 + 0.03 * model.thrust_rate_max_n_s);
  EXPECT_DOUBLE_EQ(state.thrust_command_n[3], 5 - 0.03 * model.thrust_rate_max_n_s);
  for (int i = 0; i < 200; ++i) step_rotors(model, ThrustRates::Constant(1000), 0.03, &state);
  EXPECT_LT((state.thrust_n - Eigen::Vector4d::Constant(model.thrust_max_n)).norm(), 1e-9) << "the thrust catches up";
}

TEST(RotorTorque, SignsOfEachRotor) {
  const QuadrotorModel model;
  struct Expected {
    int rotor, x, y, z;
  };
  // x: left rotors roll right (+); y: rear rotors push the nose down (+); z: by the spin.
  for (const auto& [rotor, x, y, z] : {Expected{kFrontRight, -1, -1, 1}, Expected{kRearLeft, 1, 1, 1},
                                       Expected{kFrontLeft, 1, -1, -1}, Expected{kRearRight, -1, 1, -1}}) {
    Eigen::Vector4d thrust_n = Eigen::Vector4d::Zero();
    thrust_n[rotor] = 2.0;
    const Eigen::Vector3d torque = rotor_torque_B(model, thrust_n);
    EXPECT_NEAR(torque.x(), x * 0.0771 * 2, 1e-12) << rotor;
    EXPECT_NEAR(torque.y(), y * 0.0771 * 2, 1e-12) << rotor;
    EXPECT_NEAR(torque.z(), z * 0.016 * 2, 1e-12) << rotor;
  }
  EXPECT_LT(rotor_torque_B(model, hover_thrust_n(model)).norm(), 1e-12);
}

TEST(AerodynamicWrench, WindPushesAsMovingDoes) {
  const QuadrotorModel model;
  QuadrotorState still;
  QuadrotorState moving;
  moving.v_WB = {-4, 1, 0.5};
  const Wrench in_wind = aerodynamic_wrench(model, still, {4, -1, -0.5});
  EXPECT_LT((in_wind.force_W - aerodynamic_wrench(model, moving).force_W).norm(), 1e-12);
  EXPECT_NEAR(in_wind.force_W.x(), 4 * model.drag_kg_s.x(), 1e-12);
}

TEST(ValidateQuadrotor, TheDefaultIsValid) {
  const Status status = validate(QuadrotorModel{});
  EXPECT_TRUE(status.ok()) << status.error();
}

TEST(ValidateQuadrotor, TakesWhatRealFramesAreLike) {
  QuadrotorModel plus;  // + layout
  plus.rotor_position_B_m = {Eigen::Vector2d{0.11, 0}, {-0.11, 0}, {0, 0.11}, {0, -0.11}};
  QuadrotorModel stretched;  // long and narrow
  for (auto& p : stretched.rotor_position_B_m) p.y() *= 0.3;
  QuadrotorModel coaxial_tail;  // two rotors in one place, turning opposite ways: it makes all four
  coaxial_tail.rotor_position_B_m = {Eigen::Vector2d{0.1, -0.1}, {0.1, 0.1}, {-0.1, 0}, {-0.1, 0}};
  coaxial_tail.rotor_spin = {1, -1, 1, -1};
  QuadrotorModel flat;  // a plate: the limit of the triangle rule, a rounding beyond it
  flat.inertia_kg_m2 = {3e-3, 3e-3, 6e-3 * (1 + 1e-7)};
  for (const QuadrotorModel& model : {plus, stretched, coaxial_tail, flat}) {
    const Status status = validate(model);
    EXPECT_TRUE(status.ok()) << status.error();
  }
}

TEST(ValidateQuadrotor, FailuresCarryFieldValueAndRange) {
  QuadrotorModel model;
  model.drag_kg_s.z() = 100;
  const Status status = validate(model);
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.failure().code, ErrorCode::kInvalid);
  EXPECT_EQ(status.failure().field, "quadrotor.drag_kg_s[2]");
  EXPECT_EQ(status.failure().value, "100");
  EXPECT_THAT(status.failure().expected, HasSubstr("0 to 4.15 kg/s"));
}

TEST(ValidateQuadrotor, TheDragThatIsAllowedNeverTurnsTheSpeedAround) {
  QuadrotorModel model;
  model.drag_kg_s.setConstant(model.mass_kg / kLongestStep_s);
  ASSERT_TRUE(validate(model).ok());
  QuadrotorState state = hovering(model);
  state.v_WB = {10, 0, 0};
  for (int i = 0; i < 20; ++i) {
    state = step_planner(model, state, ThrustRates::Zero(), kLongestStep_s);
    EXPECT_GE(state.v_WB.x(), -1e-12);
    EXPECT_LE(state.v_WB.norm(), 10.0);
  }
}

TEST(MendInertia, RoundsOnlyWhatRoundingCanHaveDone) {
  QuadrotorModel model;
  EXPECT_FALSE(mend_inertia(&model)) << "nothing to mend";
  model.inertia_kg_m2 = {1.43e-5, 1.43e-5, 2.89e-5};
  const auto note = mend_inertia(&model);
  ASSERT_TRUE(note);
  EXPECT_THAT(*note, HasSubstr("inertia_kg_m2.zz is 2.89e-05, taken as 2.86e-05"));
  EXPECT_EQ(model.inertia_kg_m2.z(), 1.43e-5 + 1.43e-5);
  EXPECT_FALSE(mend_inertia(&model)) << "once is enough";
  model.inertia_kg_m2 = {3e-3, 3e-3, 6.2e-3};  // 3.3 %
  EXPECT_FALSE(mend_inertia(&model));
  EXPECT_EQ(model.inertia_kg_m2.z(), 6.2e-3);
  model.inertia_kg_m2 = {6.05e-3, 3e-3, 3e-3};
  EXPECT_TRUE(mend_inertia(&model));
  EXPECT_EQ(model.inertia_kg_m2.x(), 6e-3);
}

struct BadField {
  std::string field;
  std::function<void(QuadrotorModel&)> spoil;
};

class ValidateQuadrotorField : public testing::TestWithParam<BadField> {};

TEST_P(ValidateQuadrotorField, IsNamedWithWhatWasExpected) {
  QuadrotorModel model;
  GetParam().spoil(model);
  const Status status = validate(model);
  ASSERT_FALSE(status.ok());
  EXPECT_THAT(status.error(), HasSubstr("quadrotor." + GetParam().field + " is "));
  EXPECT_THAT(status.error(), HasSubstr(", expected "));
}

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();

INSTANTIATE_TEST_SUITE_P(
    , ValidateQuadrotorField,
    testing::Values(
        BadField{"mass_kg", [](auto& m) { m.mass_kg = 0; }}, BadField{"mass_kg", [](auto& m) { m.mass_kg = -1; }},
        BadField{"mass_kg", [](auto& m) { m.mass_kg = kNan; }}, BadField{"mass_kg", [](auto& m) { m.mass_kg = 101; }},
        BadField{"inertia_kg_m2[0]", [](auto& m) { m.inertia_kg_m2.x() = 0; }},
        BadField{"inertia_kg_m2[1]", [](auto& m) { m.inertia_kg_m2.y() = kNan; }},
        BadField{"inertia_kg_m2[2]", [](auto& m) { m.inertia_kg_m2.z() = kInf; }},
        BadField{"inertia_kg_m2[0]", [](auto& m) { m.inertia_kg_m2.x() = 5e-324; }},
        BadField{"inertia_kg_m2[1]", [](auto& m) { m.inertia_kg_m2.y() = 9e-5; }},
        BadField{"inertia_kg_m2[2]",
                 [](auto& m) {
                   m.inertia_kg_m2 = {0.01, 0.01, 99};
                 }},
        BadField{"inertia_kg_m2[2]", [](auto& m) { m.inertia_kg_m2.z() = 6.3e-3; }},
        BadField{"inertia_kg_m2[0]", [](auto& m) { m.inertia_kg_m2.x() = 8.2e-3; }},
        BadField{"drag_kg_s[0]", [](auto& m) { m.drag_kg_s.x() = -0.1; }},
        BadField{"drag_kg_s[2]", [](auto& m) { m.drag_kg_s.z() = 40; }},
        BadField{"rotor_spin",
                 [](auto& m) {
                   m.rotor_spin = {1, 1, 1, 1};
                 }},
        BadField{"rotor_spin",
                 [](auto& m) {
                   m.rotor_spin = {1, -1, -1, 1};
                 }},
        BadField{"rotor_position_B_m[1]", [](auto& m) { m.rotor_position_B_m[1] = m.rotor_position_B_m[0]; }},
        BadField{"rotor_position_B_m",
                 [](auto& m) {
                   for (auto& p : m.rotor_position_B_m) p.y() = 0;
                   m.rotor_position_B_m[0].x() = 0.03;
                 }},
        BadField{"rotor_position_B_m",
                 [](auto& m) {
                   for (auto& p : m.rotor_position_B_m) p.x() += 0.2;
                 }},
        BadField{"torque_per_thrust_m", [](auto& m) { m.torque_per_thrust_m = 1e-5; }},
        BadField{"drag_kg_s[1]", [](auto& m) { m.drag_kg_s.y() = kNan; }},
        BadField{"drag_kg_s[2]", [](auto& m) { m.drag_kg_s.z() = 1e6; }},
        BadField{"rotor_position_B_m[2]", [](auto& m) { m.rotor_position_B_m[2].setZero(); }},
        BadField{"rotor_position_B_m[3]", [](auto& m) { m.rotor_position_B_m[3].x() = kNan; }},
        BadField{"rotor_spin[1]", [](auto& m) { m.rotor_spin[1] = 0; }},
        BadField{"rotor_spin[3]", [](auto& m) { m.rotor_spin[3] = 2; }},
        BadField{"torque_per_thrust_m", [](auto& m) { m.torque_per_thrust_m = 0; }},
        BadField{"torque_per_thrust_m", [](auto& m) { m.torque_per_thrust_m = kNan; }},
        BadField{"thrust_min_n", [](auto& m) { m.thrust_min_n = -0.1; }},
        BadField{"thrust_min_n", [](auto& m) { m.thrust_min_n = kNan; }},
        BadField{"thrust_min_n", [](auto& m) { m.thrust_min_n = 2.5; }},
        BadField{"thrust_max_n", [](auto& m) { m.thrust_max_n = 0; }},
        BadField{"thrust_max_n", [](auto& m) { m.thrust_max_n = kInf; }},
        BadField{"thrust_max_n", [](auto& m) { m.thrust_max_n = 2.1; }},
        BadField{"thrust_rate_max_n_s", [](auto& m) { m.thrust_rate_max_n_s = 0; }},
        BadField{"thrust_rate_max_n_s", [](auto& m) { m.thrust_rate_max_n_s = kInf; }},
        BadField{"rotor_time_constant_s", [](auto& m) { m.rotor_time_constant_s = 0; }},
        BadField{"rotor_time_constant_s", [](auto& m) { m.rotor_time_constant_s = kNan; }},
        BadField{"collision_radius_m", [](auto& m) { m.collision_radius_m = 0; }},
        BadField{"collision_radius_m", [](auto& m) { m.collision_radius_m = kNan; }}));

}  // namespace
}  // namespace gatefield
