// One gate passed several times, and heights far from the world's zero. One lockstep race each, with the learned field.

#include <gtest/gtest.h>

#include <fstream>

#include "tests/integration/race/programs.h"

namespace gatefield::test {
namespace {

using namespace std::chrono_literals;

class Courses : public ::testing::Test {
 protected:
  void expect_won(const std::string& course, const std::vector<std::string>& extra = {}) {
    std::vector<std::string> arguments{"--course", course, "--vehicle", "racer", "--speed", "5", "--lockstep"};
    arguments.insert(arguments.end(), extra.begin(), extra.end());
    Process sim = programs_.simulator("sim" + std::to_string(++flown_) + ".log", arguments);
    EXPECT_EQ(sim.wait(100s).value_or(-1), 0) << course << "\n" << sim.output() << server_.output();
  }
  /// A course file with the given waypoints and surroundings.
  std::string written(const std::string& name, const std::string& text, double inner_half_m = 0.5) {
    const auto file = programs_.file(name);
    std::ofstream(file) << text << "laps: 1 closed: false\n"
                        << "gate { inner_half_m: " << inner_half_m << " outer_half_m: " << 1.5 * inner_half_m
                        << " thickness_m: 0.06 }\n";
    return file.string();
  }

  Programs programs_{"courses"};
  Process server_ = programs_.server("server.log");
  int flown_ = 0;
};

TEST_F(Courses, TwoLapsOfOneGate) { expect_won("one-gate", {"--laps", "2"}); }

TEST_F(Courses, OneGateTwiceTheSameWay) { expect_won("same-gate-twice"); }

TEST_F(Courses, OneGateThereAndBackWithAnotherInBetween) { expect_won("there-and-back"); }

TEST_F(Courses, OneGateThereAndStraightBack) {
  expect_won(written("back.txt",
                     "waypoint { position { x: 6 y: 0 z: 1.5 } yaw_deg: 0 gate_id: 1 }\n"
                     "waypoint { position { x: 6 y: 0 z: 1.5 } yaw_deg: 180 gate_id: 1 }\n"
                     "start { position { x: 0 y: 0 z: 1.5 } yaw_deg: 0 }\n"
                     "flight_volume { min { x: -8 y: -8 z: 0 } max { x: 20 y: 8 z: 5 } }\n"
                     "floor { z: 0 }\n"));
}

TEST_F(Courses, BelowTheWorldsZero) {
  expect_won(written("below.txt",
                     "waypoint { position { x: 10 y: 0 z: -0.5 } yaw_deg: 0 }\n"
                     "waypoint { position { x: 20 y: 0 z: -0.5 } yaw_deg: 0 }\n"
                     "start { position { x: 0 y: 0 z: -0.5 } yaw_deg: 0 }\n"
                     "flight_volume { min { x: -10 y: -20 z: -70 } max { x: 90 y: 20 z: 20 } }\n"
                     "floor { z: -2 }\n"));
}

TEST_F(Courses, FiftyMetresAboveTheFloor) {
  expect_won(written("high.txt",
                     "waypoint { position { x: 10 y: 0 z: 50 } yaw_deg: 0 }\n"
                     "waypoint { position { x: 20 y: 0 z: 50 } yaw_deg: 0 }\n"
                     "start { position { x: 0 y: 0 z: 50 } yaw_deg: 0 }\n"
                     "flight_volume { min { x: -10 y: -20 z: -70 } max { x: 90 y: 20 z: 90 } }\n"
                     "floor { z: -2 }\n"));
}

TEST_F(Courses, GatesOfSeveralSizesEachOffByAThirdOfItsOpening) {
  const std::string course = written("openings.txt",
                                     "waypoint { position { x: 8 y: 0 z: 2 } yaw_deg: 0\n"
                                     "  gate { inner_half_m: 0.35 outer_half_m: 0.525 thickness_m: 0.05 } }\n"
                                     "waypoint { position { x: 17 y: 0 z: 2 } yaw_deg: 0 }\n"
                                     "start { position { x: 0 y: 0 z: 2 } yaw_deg: 0 }\n"
                                     "flight_volume { min { x: -8 y: -8 z: 0 } max { x: 30 y: 8 z: 6 } }\n"
                                     "floor { z: 0 }\n",
                                     0.9);
  expect_won(course, {"--position-noise", "0.25", "--seed", "3"});
}

TEST_F(Courses, OpeningsThatNobodySeesOrFitsThroughAreRefusedByTheirField) {
  for (const auto& [inner_half_m, why] : {std::pair(1.6, "expected 0.15 to 1.5 m"), std::pair(0.13, "expected")}) {
    const std::string course = written("refused.txt",
                                       "waypoint { position { x: 10 y: 0 z: 3 } yaw_deg: 0 }\n"
                                       "start { position { x: 0 y: 0 z: 3 } yaw_deg: 0 }\n"
                                       "flight_volume { min { x: -8 y: -8 z: 0 } max { x: 30 y: 8 z: 6 } }\n"
                                       "floor { z: 0 }\n",
                                       inner_half_m);
    Process sim = programs_.simulator("refused.log", {"--course", course, "--vehicle", "racer", "--lockstep"});
    EXPECT_NE(sim.wait(20s).value_or(0), 0) << sim.output();
    EXPECT_NE(sim.output().find("course.waypoints[0].gate.inner_half_m"), std::string::npos) << sim.output();
    EXPECT_NE(sim.output().find(why), std::string::npos) << sim.output();
  }
}

TEST_F(Courses, OneOutOfReachIsRefusedByItsField) {
  const std::string course = written("unreachable.txt",
                                     "waypoint { position { x: 10 y: 0 z: 1.5 } yaw_deg: 0 }\n"
                                     "waypoint { position { x: 20 y: 0 z: 150 } yaw_deg: 0 }\n"
                                     "start { position { x: 0 y: 0 z: 1.5 } yaw_deg: 0 }\n"
                                     "flight_volume { min { x: -10 y: -20 z: 0 } max { x: 90 y: 20 z: 200 } }\n"
                                     "floor { z: 0 }\n");
  Process sim = programs_.simulator("sim.log", {"--course", course, "--vehicle", "racer", "--lockstep"});
  EXPECT_NE(sim.wait(20s).value_or(0), 0) << sim.output();
  EXPECT_NE(sim.output().find("course.waypoints[1].p_W"), std::string::npos) << sim.output();
}

}  // namespace
}  // namespace gatefield::test
