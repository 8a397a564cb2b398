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
    std::vector<GateShape::Opening> openings;
    for (const auto& gate : nominal_world(*track).gates) openings.push_back(gate.shape.opening);
    return openings;
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
