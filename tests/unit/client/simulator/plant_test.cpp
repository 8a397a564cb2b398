#include "client/simulator/plant.h"

#include <gtest/gtest.h>

#include <cmath>

#include "common/config/course.h"

namespace gatefield::simulator {
namespace {

scene::World empty_world() {
  scene::World world;
  world.has_floor = false;
  return world;
}

QuadrotorState hovering(const Eigen::Vector3d& p_WB, const QuadrotorModel& model) {
  QuadrotorState state;
  state.p_WB = p_WB;
  state.thrust_n = state.thrust_command_n = hover_thrust_n(model);
  return state;
}

std::unique_ptr<Plant> make_plant(const scene::World& world, const QuadrotorModel& model = {},
                                  const Eigen::Vector3d& wind = Eigen::Vector3d::Zero()) {
  auto plant = Plant::create(world, model, wind);
  EXPECT_TRUE(plant.ok());
  return std::move(plant).value();
}

TEST(Plant, HoversWhereItIs) {
  const QuadrotorModel model;
  const auto plant = make_plant(empty_world(), model);
  plant->set_state(hovering({1, 2, 3}, model));
  for (int i = 0; i < 2000; ++i) plant->step(ThrustRates::Zero());
  EXPECT_EQ(plant->time(), std::chrono::seconds(2));
  EXPECT_LT((plant->state().p_WB - Eigen::Vector3d(1, 2, 3)).norm(), 1e-9);
  EXPECT_FALSE(plant->contact());
}

TEST(Plant, FliesAsTheReferenceDynamicsDo) {
  // Two seconds of wild inputs against RK4 in double precision; the two know nothing of each other but rotors and drag.
  const QuadrotorModel model;
  const auto plant = make_plant(empty_world(), model);
  QuadrotorState reference = hovering({0, 0, 5}, model);
  reference.v_WB = {4, -1, 0.5};
  reference.w_WB_B = {0.5, -0.3, 0.2};
  plant->set_state(reference);
  double fastest_rad_s = 0, farthest_m = 0;
  for (int i = 0; i < 2000; ++i) {
    const double t = 1e-3 * i;
    const ThrustRates u(6 * std::sin(11 * t), -5 * std::sin(9 * t + 1), 7 * std::cos(13 * t), -6 * std::cos(8 * t));
    plant->step(u);
    reference = step_reference(model, reference, u, 1e-3);
    fastest_rad_s = std::max(fastest_rad_s, reference.w_WB_B.norm());
    farthest_m = std::max(farthest_m, (reference.p_WB - Eigen::Vector3d(0, 0, 5)).norm());
  }
  ASSERT_GT(fastest_rad_s, 3.0) << "the inputs are too tame to show anything";
  ASSERT_GT(farthest_m, 4.0);
  const QuadrotorState& state = plant->state();
  EXPECT_LT((state.p_WB - reference.p_WB).norm(), 2e-3);
  EXPECT_LT((state.v_WB - reference.v_WB).norm(), 5e-3);
  EXPECT_LT(state.q_WB.angularDistance(reference.q_WB), 2e-3);
  EXPECT_LT((state.w_WB_B - reference.w_WB_B).norm(), 5e-3);
  EXPECT_LT((state.thrust_n - reference.thrust_n).norm(), 1e-9);
  EXPECT_LT((state.thrust_command_n - reference.thrust_command_n).norm(), 1e-9);
}

TEST(Plant, HeldThrustsAreReachedWithTheRotorsLagAlone) {
  const QuadrotorModel model;
  const auto plant = make_plant(empty_world(), model);
  plant->set_state(hovering({0, 0, 5}, model));
  const double hover_n = hover_thrust_n(model)[0];
  for (int i = 0; i < 25; ++i) plant->step_held(PlainVector4::Constant(100.0));  // more than there is
  EXPECT_EQ(plant->state().thrust_command_n[2], model.thrust_max_n);
  EXPECT_NEAR(plant->state().thrust_n[2], hover_n + (1 - std::exp(-1.0)) * (model.thrust_max_n - hover_n), 1e-9)
      << "after one time constant";
  for (int i = 0; i < 500; ++i) plant->step_held(PlainVector4::Constant(-1.0));
  EXPECT_NEAR(plant->state().thrust_n[2], model.thrust_min_n, 1e-6);
}

TEST(Plant, HeldThrustsAreTheSameFlightAsRatesThatGiveThem) {
  const QuadrotorModel model;
  const auto held = make_plant(empty_world(), model), rates = make_plant(empty_world(), model);
  QuadrotorState start = hovering({0, 0, 5}, model);
  start.v_WB = {3, 1, 0};
  start.w_WB_B = {0.2, 0.1, -0.3};
  held->set_state(start);
  rates->set_state(start);
  for (int i = 0; i < 500; ++i) {
    held->step_held(start.thrust_command_n);
    rates->step(ThrustRates::Zero());
  }
  EXPECT_LT((held->state().p_WB - rates->state().p_WB).norm(), 1e-12);
  EXPECT_LT((held->state().v_WB - rates->state().v_WB).norm(), 1e-12);
}

TEST(Plant, WindDragsAHoveringVehicleAlong) {
  const QuadrotorModel model;
  const auto plant = make_plant(empty_world(), model, {4, 0, 0});
  plant->set_state(hovering({0, 0, 5}, model));
  for (int i = 0; i < 1000; ++i) plant->step(ThrustRates::Zero());
  const double rate = model.drag_kg_s.x() / model.mass_kg;  // v = wind (1 - exp(-rate t))
  EXPECT_NEAR(plant->state().v_WB.x(), 4 * (1 - std::exp(-rate)), 1e-3);
  EXPECT_NEAR(plant->state().v_WB.y(), 0, 1e-9);
}

TEST(Plant, ASinkingVehicleTouchesTheFloorAtItsRadius) {
  const QuadrotorModel model;
  scene::World world;
  world.floor_z_m = 0.25;
  const auto plant = make_plant(world, model);
  QuadrotorState state = hovering({0, 0, 1}, model);
  state.v_WB.z() = -1;
  plant->set_state(state);
  int steps = 0;
  while (!plant->contact() && steps++ < 3000) plant->step(ThrustRates::Zero());
  ASSERT_TRUE(plant->contact());
  EXPECT_EQ(plant->contact()->with, Contact::With::kFloor);
  EXPECT_NEAR(plant->state().p_WB.z(), 0.25 + model.collision_radius_m, 0.01);
}

TEST(Plant, FliesThroughTheOpeningButNotThroughTheFrame) {
  const QuadrotorModel model;
  scene::World world = empty_world();
  world.gates.push_back({gate_pose({5, 5, 5}, Eigen::Vector3d::UnitX()), GateShape{}, 0.7f});
  world.gates.push_back({gate_pose({0, 0, 1.5}, Eigen::Vector3d::UnitX()), GateShape{}, 0.7f});
  const auto plant = make_plant(world, model);
  for (const double offset_m : {0.0, 0.3, 0.45, 0.62, 0.8, 0.95}) {
    QuadrotorState state = hovering({-1, offset_m, 1.5}, model);
    state.v_WB.x() = 8;
    plant->set_state(state);
    std::optional<Contact> contact;
    for (int i = 0; i < 250 && !contact; ++i) {
      plant->step(ThrustRates::Zero());
      contact = plant->contact();
    }
    const bool hits = offset_m > 0.5 - 0.13 && offset_m < 0.75 + 0.13;
    EXPECT_EQ(contact.has_value(), hits) << offset_m;
    if (contact) {
      EXPECT_EQ(contact->with, Contact::With::kGate);
      EXPECT_EQ(contact->index, 1);
    }
  }
}

TEST(Plant, TouchesClutter) {
  const QuadrotorModel model;
  scene::World world = empty_world();
  world.boxes.resize(2);
  world.boxes[0].X_WO.translation() = Eigen::Vector3d(0, 20, 0);
  world.boxes[1].X_WO.translation() = Eigen::Vector3d(2, 0, 1);
  const auto plant = make_plant(world, model);
  QuadrotorState state = hovering({0, 0, 1}, model);
  state.v_WB.x() = 5;
  plant->set_state(state);
  for (int i = 0; i < 600 && !plant->contact(); ++i) plant->step(ThrustRates::Zero());
  ASSERT_TRUE(plant->contact());
  EXPECT_EQ(plant->contact()->with, Contact::With::kClutter);
  EXPECT_EQ(plant->contact()->index, 1);
}

TEST(Plant, TheSameInputsGiveTheSameBits) {
  const QuadrotorModel model;
  scene::World world;
  world.gates.push_back({gate_pose({3, 0, 1.5}, Eigen::Vector3d::UnitX()), GateShape{}, 0.7f});
  const auto a = make_plant(world, model), b = make_plant(world, model);
  a->set_state(hovering({0, 0, 1}, model));
  b->set_state(hovering({0, 0, 1}, model));
  for (int i = 0; i < 1000; ++i) {
    const ThrustRates u = ThrustRates(1, -1, 0.5, 0.2) * std::sin(0.02 * i);
    a->step(u);
    b->step(u);
  }
  EXPECT_EQ(a->state().p_WB, b->state().p_WB);
  EXPECT_EQ(a->state().q_WB.coeffs(), b->state().q_WB.coeffs());
}

}  // namespace
}  // namespace gatefield::simulator
