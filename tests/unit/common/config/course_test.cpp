#include "common/config/course.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/config/locate.h"
#include "tests/unit/common/config/temporary_file.h"

namespace gatefield::config {
namespace {

using testing::HasSubstr;

std::string circle() { return read_all(find_config("courses", "circle").value()); }

std::string error_with(const std::string& from, const std::string& to) {
  const std::string text = replaced(circle(), from, to);
  EXPECT_FALSE(text.empty()) << "the shipped file has no '" << from << "'";
  const TemporaryFile file(text, "mine.txt");
  const auto track = load_track(file.path());
  if (track) return "accepted";
  EXPECT_THAT(track.error(), HasSubstr("mine.txt:"));
  EXPECT_EQ(track.failure().code, ErrorCode::kInvalid) << track.error();
  EXPECT_FALSE(track.failure().field.empty()) << track.error();
  return track.error();
}

TEST(CourseFile, TheCircleHasFourTangentialGatesCounterClockwise) {
  const auto track = load_track(find_config("courses", "circle").value());
  ASSERT_TRUE(track.ok()) << track.error();
  ASSERT_EQ(track->course.waypoints.size(), 4u);
  EXPECT_EQ(track->course.laps, 3);
  for (const auto& waypoint : track->course.waypoints) {
    EXPECT_NEAR(waypoint.p_W.head<2>().norm(), 6.0, 1e-9);
    EXPECT_EQ(waypoint.p_W.z(), 1.5);
    const Eigen::Vector3d tangent = Eigen::Vector3d::UnitZ().cross(waypoint.p_W).normalized();
    EXPECT_TRUE(waypoint.direction_W.isApprox(tangent, 1e-9));
    EXPECT_EQ(waypoint.gate.inner_half_m, 0.5);
    EXPECT_EQ(waypoint.gate.outer_half_m, 0.75);
  }
}

TEST(CourseFile, TheCircleStartsOnTheCircleBeforeTheFirstGateLookingAtIt) {
  const Track track = load_track(find_config("courses", "circle").value()).value();
  EXPECT_NEAR(track.start_p_WB.head<2>().norm(), 6.0, 0.01);
  const Eigen::Vector3d to_gate = track.course.waypoints[0].p_W - track.start_p_WB;
  EXPECT_GT(to_gate.norm(), 4.0);
  EXPECT_LT(to_gate.norm(), 5.0);
  EXPECT_NEAR(std::atan2(to_gate.y(), to_gate.x()), track.start_yaw_rad, 0.01);
}

TEST(CourseFile, GatesStandAcrossTheirPassingDirection) {
  const Track track = load_track(find_config("courses", "circle").value()).value();
  const scene::World world = nominal_world(track);
  ASSERT_EQ(world.gates.size(), 4u);
  for (std::size_t i = 0; i < 4; ++i) {
    const auto& X_WG = world.gates[i].X_WG;
    EXPECT_TRUE(X_WG.linear().col(0).isApprox(track.course.waypoints[i].direction_W, 1e-9));
    EXPECT_TRUE(X_WG.linear().col(2).isApprox(Eigen::Vector3d::UnitZ(), 1e-9));
    EXPECT_NEAR(X_WG.linear().determinant(), 1.0, 1e-9);
  }
}

TEST(CourseFile, EachGateHasItsOwnOpeningOrThatOfAll) {
  constexpr auto kSquare = GateShape::Opening::kSquare, kRound = GateShape::Opening::kRound;
  const auto openings = [](const std::string& text) {
    const TemporaryFile file(text, "mine.txt");
    const auto track = load_track(file.path());
    EXPECT_TRUE(track.ok()) << track.error();
    std::vector<GateShape::Opening> found;
    for (const scene::World world = nominal_world(*track); const auto& gate : world.gates)
      found.push_back(gate.shape.opening);
    return found;
  };
  const std::string mixed = read_all(find_config("courses", "mixed").value());
  EXPECT_THAT(openings(circle()), testing::Each(kSquare));
  EXPECT_THAT(openings(mixed), testing::ElementsAre(kSquare, kRound, kSquare, kRound));
  EXPECT_THAT(openings(replaced(mixed, "opening: SQUARE", "opening: ROUND")), testing::Each(kRound));
  EXPECT_THAT(openings(replaced(replaced(mixed, "opening: SQUARE", "opening: ROUND"), "y:  0 z: 1.5 }",
                                "y:  0 z: 1.5 } opening: SQUARE")),
              testing::ElementsAre(kSquare, kRound, kRound, kRound));
  EXPECT_THAT(error_with("x:  6 y:  0 z: 1.5 }", "x:  6 y:  0 z: 1.5 } opening: OVAL"),
              HasSubstr("7:58: 'OVAL' is no value of field 'opening'"));
}

TEST(CourseFile, AWaypointMayHaveAGateOfItsOwnSize) {
  constexpr const char* kFirst = "x:  6 y:  0 z: 1.5 }";
  const TemporaryFile file(replaced(circle(), kFirst,
                                    std::string(kFirst) + " gate { opening: ROUND inner_half_m: 0.35 outer_half_m: 0.5 "
                                                          "thickness_m: 0.1 }"));
  const auto track = load_track(file.path());
  ASSERT_TRUE(track.ok()) << track.error();
  const auto world = nominal_world(*track);
  EXPECT_EQ(world.gates[0].shape.opening, GateShape::Opening::kRound);
  EXPECT_EQ(world.gates[0].shape.inner_half_m, 0.35);
  EXPECT_EQ(world.gates[0].shape.outer_half_m, 0.5);
  EXPECT_EQ(world.gates[0].shape.thickness_m, 0.1);
  EXPECT_EQ(world.gates[1].shape.opening, GateShape::Opening::kSquare);
  EXPECT_EQ(world.gates[1].shape.inner_half_m, 0.5);
  EXPECT_EQ(world.gates[0].reflectance, world.gates[1].reflectance) << "the course's, where none is said";

  const std::string own = " gate { inner_half_m: 0.5 outer_half_m: 0.4 thickness_m: 0.1 reflectance: 0.2 }";
  EXPECT_THAT(error_with(kFirst, kFirst + own), HasSubstr("waypoint[0].gate.outer_half_m is 0.4"));
  EXPECT_THAT(error_with(kFirst, std::string(kFirst) + " opening: ROUND" + own), HasSubstr("both opening and gate"));
  const TemporaryFile dark(
      replaced(circle(), kFirst, kFirst + replaced(own, "outer_half_m: 0.4", "outer_half_m: 0.6")));
  EXPECT_EQ(nominal_world(*load_track(dark.path())).gates[0].reflectance, 0.2f);
}

TEST(CourseFile, GatesMayStandOnLegsThatThePlannerIsNotToldOf) {
  const std::string legs = "thickness_m: 0.06 leg_width_m: 0.05";
  const TemporaryFile file(replaced(circle(), "thickness_m: 0.06", legs));
  const auto track = load_track(file.path());
  ASSERT_TRUE(track.ok()) << track.error();
  const scene::World world = nominal_world(*track);
  EXPECT_EQ(world.gates.size(), 4u);
  ASSERT_EQ(world.boxes.size(), 8u);
  for (const scene::Box& leg : world.boxes)
    EXPECT_NEAR(leg.X_WO.translation().z() - leg.half_m.z(), track->floor_z_m, 1e-12);
  EXPECT_TRUE(bare_world(*track).boxes.empty());
  EXPECT_THAT(error_with("thickness_m: 0.06", "thickness_m: 0.06 leg_width_m: 2"),
              HasSubstr("gate.leg_width_m is 2, expected 0.005 to 0.75 m"));
  const TemporaryFile floating(replaced(replaced(circle(), "thickness_m: 0.06", legs), "floor { z: 0 }", ""));
  EXPECT_THAT(load_track(floating.path()).error(), HasSubstr("expected a floor to stand on"));
}

std::string course_of(const std::string& waypoints, const std::string& more = "") {
  return waypoints + "closed: false\n" + more +
         "gate { inner_half_m: 0.5 outer_half_m: 0.75 thickness_m: 0.06 }\n"
         "start { position { x: 0 y: 0 z: 1.5 } yaw_deg: 0 }\n"
         "flight_volume { min { x: -8 y: -10 z: -70 } max { x: 24 y: 10 z: 90 } }\n";
}

Result<Track> track_of(const std::string& waypoints, const std::string& more = "") {
  const TemporaryFile file(course_of(waypoints, more), "mine.txt");
  return load_track(file.path());
}

TEST(CourseFile, WaypointsThatNameOneGateAreItsPassages) {
  const auto track = track_of(
      "waypoint { position { x: 5 y: 0 z: 1.5 } yaw_deg: 0 gate_id: 7 }\n"
      "waypoint { position { x: 12 y: 3 z: 1.5 } yaw_deg: 90 }\n"
      "waypoint { position { x: 5 y: 0 z: 1.5 } yaw_deg: 180 gate_id: 7 }\n");
  ASSERT_TRUE(track.ok()) << track.error();
  EXPECT_EQ(nominal_world(*track).gates.size(), 2u);
  const auto lap = passages(track->course);
  ASSERT_EQ(lap.size(), 3u);
  EXPECT_EQ(lap[0].gate, 0u);
  EXPECT_EQ(lap[1].gate, 1u);
  EXPECT_EQ(lap[2].gate, 0u);
  EXPECT_TRUE(lap[0].along_x && lap[1].along_x);
  EXPECT_FALSE(lap[2].along_x);

  EXPECT_THAT(track_of("waypoint { position { x: 5 y: 0 z: 1.5 } yaw_deg: 0 gate_id: 7 }\n"
                       "waypoint { position { x: 6 y: 0 z: 1.5 } yaw_deg: 0 gate_id: 7 }\n")
                  .error(),
              HasSubstr("the place of waypoints[0], which names the same gate (7)"));
}

TEST(CourseFile, WaypointsAtOnePlaceAreOneGateAlsoWithoutANumber) {
  const auto back = track_of(
      "waypoint { position { x: 5 y: 0 z: 1.5 } yaw_deg: 0 }\n"
      "waypoint { position { x: 12 y: 3 z: 1.5 } yaw_deg: 90 gate_id: 1 }\n"
      "waypoint { position { x: 5 y: 0.005 z: 1.5 } yaw_deg: 170 }\n");
  ASSERT_TRUE(back.ok()) << back.error();
  EXPECT_EQ(gate_count(back->course), 2u);
  EXPECT_FALSE(passages(back->course)[2].along_x);
  EXPECT_NE(back->course.waypoints[0].gate_id, back->course.waypoints[1].gate_id);

  const auto twice = track_of(
      "waypoint { position { x: 5 y: 0 z: 1.5 } yaw_deg: 0 }\n"
      "waypoint { position { x: 5 y: 0 z: 1.5 } yaw_deg: 0 }\n");
  ASSERT_TRUE(twice.ok()) << twice.error();
  EXPECT_EQ(nominal_world(*twice).gates.size(), 1u);
  EXPECT_TRUE(passages(twice->course)[1].along_x);
}

TEST(CourseFile, AnotherPlaceShapeOrAxisIsAnotherGate) {
  const std::string first = "waypoint { position { x: 5 y: 0 z: 1.5 } yaw_deg: 0 }\n";
  for (const char* other :
       {"position { x: 5 y: 0.02 z: 1.5 } yaw_deg: 180", "position { x: 5 y: 0 z: 1.5 } yaw_deg: 90",
        "position { x: 5 y: 0 z: 1.5 } yaw_deg: 180 opening: ROUND"}) {
    const auto track = track_of(first + "waypoint { " + other + " }\n");
    ASSERT_TRUE(track.ok()) << track.error();
    EXPECT_EQ(gate_count(track->course), 2u) << other;
  }
  const auto shipped = load_track(find_config("courses", "circle").value());
  for (const auto& waypoint : shipped->course.waypoints) EXPECT_EQ(waypoint.gate_id, 0u);
}

TEST(CourseFile, CoursesHighAboveAndBelowTheOriginLoadAndTellTheirFloor) {
  for (const double z_m : {-0.5, 50.0, -55.8}) {
    const std::string text =
        course_of("waypoint { position { x: 10 y: 0 z: " + std::to_string(z_m) + " } yaw_deg: 0 }\n",
                  "floor { z: " + std::to_string(z_m - 1.5) + " }\n");
    const TemporaryFile file(
        replaced(text, "y: 0 z: 1.5 } yaw_deg: 0", "y: 0 z: " + std::to_string(z_m) + " } yaw_deg: 0"));
    const auto track = load_track(file.path());
    ASSERT_TRUE(track.ok()) << track.error();
    EXPECT_EQ(track->course.floor_z_m, track->floor_z_m);
    EXPECT_NEAR(height_reference_m(track->course), z_m - 1.5, 1e-6);
  }
  EXPECT_FALSE(track_of("waypoint { position { x: 10 y: 0 z: 5 } yaw_deg: 0 }\n")->course.floor_z_m);
}

TEST(CourseFile, AnOpenCourseOfOneGateMayHaveSeveralLaps) {
  const auto track = track_of("waypoint { position { x: 5 y: 0 z: 1.5 } yaw_deg: 0 }\n", "laps: 3\n");
  ASSERT_TRUE(track.ok()) << track.error();
  EXPECT_EQ(track->course.laps, 3);
}

TEST(CourseFile, ObstaclesBecomeBoxes) {
  const TemporaryFile file(circle() +
                           "box { center { x: 1 y: 2 z: 1 } size { x: 2 y: 1 z: 2 } yaw_deg: 90 }\n"
                           "pole { x: -1 y: 0 z_bottom: 0 height: 3 width: 0.1 reflectance: 0.2 }\n");
  const auto track = load_track(file.path());
  ASSERT_TRUE(track.ok()) << track.error();
  ASSERT_EQ(track->clutter.size(), 2u);
  EXPECT_TRUE((track->clutter[0].X_WO.linear() * Eigen::Vector3d::UnitX()).isApprox(Eigen::Vector3d::UnitY(), 1e-9));
  EXPECT_EQ(track->clutter[1].half_m, Eigen::Vector3d(0.05, 0.05, 1.5));
  EXPECT_EQ(track->clutter[1].X_WO.translation(), Eigen::Vector3d(-1, 0, 1.5));
}

TEST(CourseFile, ErrorsNameFieldValueAndWhatWasExpected) {
  EXPECT_THAT(error_with("inner_half_m: 0.5", "inner_half_m: 0.9"), HasSubstr("gate.outer_half_m is 0.75"));
  EXPECT_THAT(error_with("laps: 3", "laps: 0"), HasSubstr("laps is 0, expected 1 to 1000"));
  EXPECT_THAT(error_with("x:  6 y:  0 z: 1.5", "x: 60 y: 0 z: 1.5"),
              HasSubstr("waypoint[0].position is (60, 0, 1.5), expected a place in the flight volume"));
  EXPECT_THAT(error_with("x:  6 y:  0 z: 1.5", "x: 6 y: 0 z: 0.5"), HasSubstr("expected z of at least 0.75"));
  EXPECT_THAT(error_with("x:  6 y:  0 z: 1.5", "x: inf y: 0 z: 0.5"), HasSubstr("waypoint[0].position"));
  EXPECT_THAT(error_with("max { x: 12 y: 12 z: 5 }", "max { x: -13 y: 12 z: 5 }"), HasSubstr("flight_volume.max"));
  EXPECT_THAT(error_with("x: 4.390 y: -4.090", "x: 40 y: 0"), HasSubstr("start.position is (40, 0, 1.5)"));
  EXPECT_THAT(error_with("waypoint { position { x:  6 y:  0 z: 1.5 } }",
                         "waypoint { position { x:  6 y:  0 z: 1.5 } yaw_deg: 1 direction { x: 1 y: 0 z: 0 } }"),
              HasSubstr("both yaw_deg and direction"));
}

TEST(CourseFile, ACourseWithoutWaypointsIsRefused) {
  const TemporaryFile file(
      "gate { inner_half_m: 0.5 outer_half_m: 0.75 thickness_m: 0.06 }\n"
      "start { position { x: 0 y: 0 z: 1 } yaw_deg: 0 }\n"
      "flight_volume { min { x: -1 y: -1 z: 0 } max { x: 1 y: 1 z: 2 } }\n");
  EXPECT_THAT(load_track(file.path()).error(), HasSubstr("waypoint is given 0 times, expected 1 to 64"));
}

}  // namespace
}  // namespace gatefield::config
