// Races in a harder world, flown by a client that needs no server.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "client/simulator/simulation.h"
#include "common/config/locate.h"
#include "tests/support/path_follower.h"

namespace gatefield::simulator {
namespace {

using config::WorldPart;
using namespace std::chrono_literals;

const std::atomic<bool> kGoOn{false};

struct Flown {
  Report report;
  test::PathFollower::Received received;
};

config::Scenario circle(const std::vector<WorldPart>& parts, Stamp time_limit = 1s) {
  auto scenario = config::load_scenario(config::find_config("scenarios", "circle-0.3m").value()).value();
  scenario.hard = config::hard_world(parts);
  scenario.time_limit = time_limit;
  return scenario;
}

Flown fly_once(const config::Scenario& scenario, protocol::Timing timing = protocol::Timing::kLockstep) {
  test::PathFollower client(config::true_world(scenario), scenario.vehicle.quadrotor, {});
  Options options;
  options.timing = timing;
  auto report = fly(scenario, options, &client, kGoOn);
  EXPECT_TRUE(report.ok()) << report.error();
  return {std::move(report).value(), client.received()};
}

Eigen::Vector3d end(const Flown& flown) { return flown.report.samples.back().state.p_WB; }

TEST(HardRace, EachPartThatMovesTheVehicleFliesAnotherRaceAndTheSameAgain) {
  const Eigen::Vector3d easy = end(fly_once(circle({})));
  EXPECT_EQ(end(fly_once(circle({WorldPart::kEasy}))), easy);
  for (const auto& [name, part] : config::world_part_names()) {
    const Flown flown = fly_once(circle({part}));
    EXPECT_EQ(end(flown), end(fly_once(circle({part})))) << name;
    EXPECT_THAT(summarize(flown.report),
                testing::HasSubstr(part == WorldPart::kEasy ? "Result" : "World         " + name));
    // This client follows its state alone, without the camera, and jumps may be a while off.
    const bool moves = part == WorldPart::kHard || part == WorldPart::kDrift || part == WorldPart::kLag ||
                       part == WorldPart::kDrag || part == WorldPart::kInflow || part == WorldPart::kBattery ||
                       part == WorldPart::kGroundEffect || part == WorldPart::kThrustUnknown;
    if (part == WorldPart::kJumps) continue;
    EXPECT_EQ(end(flown) != easy, moves) << name;
  }
}

TEST(HardRace, UnknownThrustIsNotSent) {
  const Flown flown = fly_once(circle({WorldPart::kThrustUnknown}));
  EXPECT_FALSE(flown.received.thrust_known);
  EXPECT_TRUE(flown.received.first.thrust_n.isZero(0.0));
  EXPECT_TRUE(fly_once(circle({})).received.thrust_known);
}

TEST(HardRace, TheVehicleHoversAtTheStartWhateverItsBatteryGives) {
  auto scenario = circle({WorldPart::kBattery});
  for (scenario.seed = 1; scenario.seed <= 3; ++scenario.seed) {
    const Flown flown = fly_once(scenario);
    const double hover_n = hover_thrust_n(scenario.vehicle.quadrotor)[0];
    EXPECT_GT(std::abs(flown.received.first.thrust_n[0] - hover_n), 1e-3) << "what is known is what it is set to";
    EXPECT_NEAR(flown.received.first.thrust_n[0] / hover_n, 0.95, 0.16);
  }
}

TEST(HardRace, ASlowCamerasFramesComeLateWithTheStampsOfTheirTime) {
  auto scenario = circle({WorldPart::kSlowCamera});
  scenario.vehicle.camera.rate_hz = scenario.hard.camera_rate_hz;
  const Flown flown = fly_once(scenario);
  EXPECT_NEAR(static_cast<double>(flown.received.frames.size()), 30, 2);
  EXPECT_EQ(flown.received.frames.front(), kLockstepEpoch);
  EXPECT_LE(flown.received.frames.back(), kLockstepEpoch + 1s - 30ms);
}

TEST(HardRace, StampsAreOff) {
  const Flown flown = fly_once(circle({WorldPart::kStamps}));
  EXPECT_EQ(std::chrono::abs(flown.received.frames.front() - kLockstepEpoch), 5ms);
}

TEST(HardRace, SamplesSayWhereTheEstimateHasThings) {
  const Flown flown = fly_once(circle({WorldPart::kDrift}));
  EXPECT_GT(flown.report.samples.at(80).X_EW.translation().norm(), 1e-4);
  EXPECT_TRUE(fly_once(circle({})).report.samples.at(80).X_EW.isApprox(Eigen::Isometry3d::Identity(), 0.0));
}

TEST(HardRace, AHallIsHitWhereItIsSeen) {
  auto scenario = circle({WorldPart::kFurniture}, 20s);
  scenario.track.flight_volume.max().x() += 1.0;  // the race's bound; the wall moves with it
  const scene::World world = config::true_world(scenario);
  auto plant = Plant::create(world, scenario.vehicle.quadrotor).value();
  QuadrotorState state = start_state(scenario);
  state.p_WB = {12.0, 0.5, 1.5};
  state.v_WB = {4, 0, 0};
  plant->set_state(state);
  while (!plant->contact() && plant->time() < 1s) plant->step(ThrustRates::Zero());
  ASSERT_TRUE(plant->contact());
  EXPECT_EQ(plant->contact()->with, Contact::With::kClutter);
  EXPECT_NEAR(plant->state().p_WB.x(), 13.0 - scenario.vehicle.quadrotor.collision_radius_m, 0.02);
}

TEST(HardRace, FliesInRealTimeToo) {
  auto scenario = circle({WorldPart::kHard, WorldPart::kFurniture});
  // This client integrates thrust from what it is sent, and has nothing to begin with here.
  scenario.vehicle.actuation = config::driven_by(scenario.vehicle, Actuation::Kind::kBodyRates);
  scenario.vehicle.camera.rate_hz = scenario.hard.camera_rate_hz;
  const Flown flown = fly_once(scenario, protocol::Timing::kRealTime);
  EXPECT_EQ(flown.report.outcome, Outcome::kTimeLimit) << flown.report.sentence;
  EXPECT_FALSE(flown.received.thrust_known);
  EXPECT_GT(flown.received.frames.size(), 5u);
  EXPECT_GT(flown.report.top_speed_m_s, 1.0);
}

}  // namespace
}  // namespace gatefield::simulator
