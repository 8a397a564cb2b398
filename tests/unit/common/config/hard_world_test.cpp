#include "common/config/hard_world.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>

#include "common/config/locate.h"
#include "common/config/scenario.h"
#include "tests/unit/common/config/temporary_file.h"

namespace gatefield::config {
namespace {

using testing::HasSubstr;
using namespace std::chrono_literals;

Result<Scenario> scenario_from(const std::string& more) {
  const TemporaryFile file("course: \"circle\"\nvehicle: \"racer\"\n" + more, "mine.txt");
  return load_scenario(file.path());
}

/// Nothing of a harder world but what `part` is about; counts what differs from an easy one.
int differences(const HardWorld& world) {
  const HardWorld easy;
  int count = 0;
  for (const bool differs :
       {world.estimate.drift_m_s > 0, world.estimate.jumps_hz > 0, world.estimate.lag > Stamp{0}, world.thrust_unknown,
        world.camera.delay > Stamp{0}, world.camera.exposure > Stamp{0}, world.camera.stamp_error > Stamp{0},
        world.camera.mounting_rad > 0, world.air.drag_area_level > 0, world.air.advance_ratio > 0, world.air.sag > 0,
        world.air.ground_effect, world.furniture})
    count += differs ? 1 : 0;
  return count;
}

TEST(HardWorld, AnEasyOneHasNothing) {
  EXPECT_EQ(differences(scenario_from("")->hard), 0);
  EXPECT_EQ(differences(scenario_from("world: EASY")->hard), 0);
  EXPECT_FALSE(scenario_from("")->hard.air.any());
  EXPECT_EQ(in_words(scenario_from("world: EASY")->hard.parts), "");
}

TEST(HardWorld, EachPartIsItselfAloneAndHardIsAllButFurniture) {
  int parts = 0;
  for (const auto& [name, part] : world_part_names()) {
    if (part == WorldPart::kEasy || part == WorldPart::kHard) continue;
    EXPECT_EQ(differences(hard_world({part})), 1) << name;
    EXPECT_EQ(in_words({part}), name);
    ++parts;
  }
  EXPECT_EQ(differences(hard_world({WorldPart::kHard})), parts - 1);
  EXPECT_FALSE(hard_world({WorldPart::kHard}).furniture);
  EXPECT_EQ(differences(scenario_from("world: [HARD, FURNITURE]")->hard), parts);
}

TEST(HardWorld, SizesArriveInTheCodesUnits) {
  const auto scenario = scenario_from(
      "world: [DRIFT, LAG, MOUNTING] world: SLOW_CAMERA\n"
      "world_sizes { drift_yaw_deg_s: 2 lag_ms: 25 mounting_deg: 3 camera_rate_hz: 20 }\n");
  ASSERT_TRUE(scenario.ok()) << scenario.error();
  const HardWorld& hard = scenario->hard;
  EXPECT_NEAR(hard.estimate.drift_yaw_rad_s, 2 * std::numbers::pi / 180, 1e-12);
  EXPECT_EQ(hard.estimate.drift_m_s, 0.05) << "as it is";
  EXPECT_EQ(hard.estimate.lag, 25ms);
  EXPECT_NEAR(hard.camera.mounting_rad, 3 * std::numbers::pi / 180, 1e-12);
  EXPECT_EQ(hard.camera.delay, 30ms);
  EXPECT_EQ(scenario->vehicle.camera.rate_hz, 20) << "which is told";
  EXPECT_EQ(scenario_from("world: HARD camera_rate_hz: 50")->vehicle.camera.rate_hz, 50);
  EXPECT_EQ(in_words(hard.parts), "drift, lag, mounting, slow-camera");
}

TEST(HardWorld, ErrorsNameFieldValueAndRange) {
  EXPECT_THAT(scenario_from("world: LAG world_sizes { lag_ms: 300 }").error(),
              HasSubstr("mine.txt: world_sizes.lag_ms is 300, expected 0 to 200 ms"));
  EXPECT_THAT(scenario_from("world: DRIFT world_sizes { lag_ms: 3 }").error(),
              HasSubstr("world_sizes.lag_ms is 3, expected none: world has neither HARD nor LAG"));
  EXPECT_THAT(scenario_from("world: HARD world_sizes { charge_low: 0.9 charge_high: 0.2 }").error(),
              HasSubstr("world_sizes.charge_low is 0.9, expected at most charge_high, 0.2"));
  EXPECT_THAT(scenario_from("world: HARDER").error(), HasSubstr("HARDER"));
}

TEST(HardWorld, FurnitureStandsInTheRoomAndTheGatesAsTheyDid) {
  auto scenario = scenario_from("perturbation { position_m: 0.3 } world: FURNITURE seed: 3").value();
  const scene::World hall = true_world(scenario), again = true_world(scenario);
  const scene::World bare = perturbed_world(scenario.track, scenario.perturbation, scenario.seed);
  ASSERT_EQ(hall.gates.size(), bare.gates.size());
  for (std::size_t i = 0; i < bare.gates.size(); ++i)
    EXPECT_EQ(hall.gates[i].X_WG.matrix(), bare.gates[i].X_WG.matrix());
  EXPECT_GT(hall.boxes.size(), bare.boxes.size() + 30);
  ASSERT_EQ(hall.boxes.size(), again.boxes.size());
  for (std::size_t i = 0; i < hall.boxes.size(); ++i)
    EXPECT_EQ(hall.boxes[i].X_WO.matrix(), again.boxes[i].X_WO.matrix());
  // Clear of gates and of the circle between them, on which everybody flies.
  for (const scene::Box& box : hall.boxes) {
    if (box.half_m.head<2>().maxCoeff() > 5.0) continue;  // a wall
    const double way_m = std::abs(box.X_WO.translation().head<2>().norm() - 6.0);
    EXPECT_GT(way_m, 1.2 + box.half_m.head<2>().norm()) << box.X_WO.translation().transpose();
    for (const scene::Gate& gate : hall.gates)
      EXPECT_GT((box.X_WO.translation() - gate.X_WG.translation()).head<2>().norm(), 2.0);
  }
  scenario.seed = 4;
  EXPECT_NE(true_world(scenario).boxes.back().X_WO.matrix(), hall.boxes.back().X_WO.matrix());
}

}  // namespace
}  // namespace gatefield::config
