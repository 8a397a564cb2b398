#include "common/config/scenario.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <numbers>

#include "common/config/locate.h"
#include "tests/unit/common/config/temporary_file.h"

namespace gatefield::config {
namespace {

using testing::HasSubstr;

constexpr double kDegree = std::numbers::pi / 180.0;

Track circle() { return load_track(find_config("courses", "circle").value()).value(); }

Result<Scenario> scenario_from(const std::string& more) {
  const TemporaryFile file("course: \"circle\"\nvehicle: \"racer\"\n" + more, "mine.txt");
  return load_scenario(file.path());
}

TEST(Scenario, EveryShippedOneLoads) {
  int count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(*config_folder() / "scenarios")) {
    const auto scenario = load_scenario(entry.path());
    EXPECT_TRUE(scenario.ok()) << scenario.error();
    ++count;
  }
  EXPECT_GE(count, 6);
}

TEST(Scenario, ValuesArrive) {
  const auto scenario = scenario_from(
      "perturbation { position_m: 0.3 yaw_deg: 30 tilt_deg: 5 }\n"
      "sensor_noise { scale: 2 hole_radius_px: 5 }\n"
      "state_noise { position_m: 0.01 attitude_deg: 1 }\n"
      "mismatch { mass_factor: 1.1 wind_m_s { x: 4 } }\n"
      "camera_rate_hz: 30 seed: 7 time_limit_s: 20\n");
  ASSERT_TRUE(scenario.ok()) << scenario.error();
  EXPECT_EQ(scenario->perturbation.position_m, 0.3);
  EXPECT_EQ(scenario->perturbation.height_m, 0.15);
  EXPECT_NEAR(scenario->perturbation.yaw_rad, 30 * kDegree, 1e-12);
  EXPECT_EQ(scenario->sensor_noise.scale, 2);
  EXPECT_EQ(scenario->sensor_noise.hole_radius_px, 5);
  EXPECT_EQ(scenario->sensor_noise.baseline_m, scene::SensorNoise{}.baseline_m);
  EXPECT_NEAR(scenario->state_noise.attitude_rad, kDegree, 1e-12);
  EXPECT_EQ(scenario->mismatch.wind_W_m_s.x(), 4);
  EXPECT_EQ(scenario->vehicle.camera.rate_hz, 30);
  EXPECT_EQ(scenario->seed, 7u);
  EXPECT_FALSE(scenario->planner_seed);
  EXPECT_EQ(planner_seed_of(*scenario), default_planner_seed(7));
  EXPECT_EQ(scenario->time_limit, std::chrono::seconds(20));
}

TEST(Scenario, SensorNoiseComesFromAFileWhenItSaysSo) {
  const TemporaryFile fitted("disparity_noise_px: 0.07\nhole_rate_per_image: 9\n", "fitted.txt");
  const auto scenario = scenario_from("sensor_noise_file: \"" + fitted.path().string() + "\"");
  ASSERT_TRUE(scenario.ok()) << scenario.error();
  EXPECT_EQ(scenario->sensor_noise.disparity_noise_px, 0.07);
  EXPECT_EQ(scenario->sensor_noise.hole_rate_per_image, 9);
  EXPECT_EQ(scenario->sensor_noise.bleed_probability, scene::SensorNoise{}.bleed_probability);
  EXPECT_THAT(scenario_from("sensor_noise_file: \"no-such-file.txt\"").error(), HasSubstr("sensor_noise_file"));
  EXPECT_THAT(scenario_from("sensor_noise { scale: 1 }\nsensor_noise_file: \"" + fitted.path().string() + "\"").error(),
              HasSubstr("both set"));
}

TEST(Scenario, ThePairOfCamerasTakesThePlaceOfTheNoise) {
  EXPECT_FALSE(scenario_from("")->stereo);
  EXPECT_EQ(scenario_from("stereo { }")->stereo->pattern, scene::StereoOptions().pattern);
  EXPECT_EQ(scenario_from("stereo { pattern: 0.5 }")->stereo->pattern, 0.5);
  EXPECT_THAT(scenario_from("stereo { }\nsensor_noise { }").error(), HasSubstr("both set, expected one"));
  EXPECT_THAT(scenario_from("stereo { lamp: -1 }").error(), HasSubstr("stereo.lamp is -1"));
}

TEST(Scenario, SaysByWhatContactIsJudgedAndHowGatesAreDrawn) {
  EXPECT_EQ(scenario_from("")->hull, HullKind::kDiscs);
  EXPECT_EQ(scenario_from("hull: SPHERE")->hull, HullKind::kSphere);
  EXPECT_FALSE(scenario_from("perturbation { position_m: 0.3 }")->perturbation.exact);
  const auto exact = scenario_from("perturbation { position_m: 0.3 exact: true }");
  ASSERT_TRUE(exact.ok()) << exact.error();
  EXPECT_TRUE(exact->perturbation.exact);
  EXPECT_EQ(exact->perturbation.height_m, 0.15);
  EXPECT_TRUE(scenario_from("perturbation { position_m: 0.3 height_m: 0.4 }").ok());
  EXPECT_THAT(scenario_from("perturbation { position_m: 0.3 height_m: 0.4 exact: true }").error(),
              HasSubstr("perturbation.height_m is 0.4, expected 0 to 0.3 m, position_m at most"));
}

TEST(Scenario, ErrorsNameFileFieldValueAndRange) {
  EXPECT_THAT(scenario_from("perturbation { position_m: -1 }").error(),
              HasSubstr("mine.txt: perturbation.position_m is -1, expected 0 to 5 m"));
  EXPECT_THAT(scenario_from("mismatch { mass_factor: 0 }").error(),
              HasSubstr("mismatch.mass_factor is 0, expected 0.2 to 5"));
  EXPECT_THAT(scenario_from("camera_rate_hz: 1000").error(), HasSubstr("camera.rate_hz is 1000"));
  EXPECT_THAT(scenario_from("perturbation { position: 1 }").error(), HasSubstr("mine.txt:3:"));
  const TemporaryFile file("course: \"nowhere\"\nvehicle: \"racer\"\n", "mine.txt");
  EXPECT_THAT(load_scenario(file.path()).error(), HasSubstr("'nowhere' is neither a file nor one of the courses"));
}

TEST(Scenario, ThePlannersSeedIsANumberOfItsOwn) {
  const auto scenario = scenario_from("seed: 7 planner_seed: 900");
  ASSERT_TRUE(scenario.ok()) << scenario.error();
  EXPECT_EQ(scenario->seed, 7u);
  EXPECT_EQ(planner_seed_of(*scenario), 900u);
}

TEST(Perturbation, NoneLeavesTheNominalWorld) {
  const Track track = circle();
  const auto world = perturbed_world(track, {}, 3);
  const auto nominal = nominal_world(track);
  for (std::size_t i = 0; i < 4; ++i) EXPECT_TRUE(world.gates[i].X_WG.isApprox(nominal.gates[i].X_WG, 1e-12));
}

TEST(Perturbation, SameSeedSameWorldOtherSeedOtherWorld) {
  const Track track = circle();
  const Perturbation perturbation{0.3, 0.15, 0.5, 0.1};
  const auto a = perturbed_world(track, perturbation, 11);
  const auto b = perturbed_world(track, perturbation, 11);
  const auto c = perturbed_world(track, perturbation, 12);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(a.gates[i].X_WG.matrix(), b.gates[i].X_WG.matrix());
    EXPECT_GT((a.gates[i].X_WG.translation() - c.gates[i].X_WG.translation()).norm(), 1e-3);
  }
}

TEST(Perturbation, MagnitudesAreWhatTheFileSays) {
  const Track track = circle();
  const auto nominal = nominal_world(track);
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  double smallest_yaw = 10, largest_yaw = 0, largest_rise = 0;
  int left = 0, count = 0;
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    const auto world = perturbed_world(track, {0.3, 0.15, 60 * kDegree, 0}, seed);
    for (std::size_t i = 0; i < 4; ++i, ++count) {
      const Eigen::Vector3d moved = world.gates[i].X_WG.translation() - nominal.gates[i].X_WG.translation();
      EXPECT_NEAR(moved.head<2>().norm(), 0.3, 1e-9);
      EXPECT_LE(std::abs(moved.z()), 0.15);
      largest_rise = std::max(largest_rise, std::abs(moved.z()));
      mean += moved.head<2>();
      const Eigen::Matrix3d turn = world.gates[i].X_WG.linear() * nominal.gates[i].X_WG.linear().transpose();
      const double yaw = std::atan2(turn(1, 0), turn(0, 0));
      EXPECT_TRUE(turn.col(2).isApprox(Eigen::Vector3d::UnitZ(), 1e-9));
      smallest_yaw = std::min(smallest_yaw, std::abs(yaw));
      largest_yaw = std::max(largest_yaw, std::abs(yaw));
      left += yaw > 0;
    }
  }
  EXPECT_LT((mean / count).norm(), 0.03) << "directions lean to one side";
  EXPECT_GT(largest_rise, 0.14);
  EXPECT_GE(smallest_yaw, 30 * kDegree - 1e-9);
  EXPECT_LT(smallest_yaw, 31 * kDegree);
  EXPECT_LE(largest_yaw, 60 * kDegree + 1e-9);
  EXPECT_GT(largest_yaw, 59 * kDegree);
  EXPECT_NEAR(2 * left, count, 160);
}

TEST(Perturbation, ExactIsThatLargeInRandomWays) {
  const Track track = circle();
  const auto nominal = nominal_world(track);
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  double largest_rise_m = 0.0;
  int left = 0, count = 0, high = 0;
  for (std::uint64_t seed = 1; seed <= 300; ++seed) {
    const auto turned = perturbed_world(track, {0.3, 0.15, 60 * kDegree, 0, true}, seed);
    const auto leant = perturbed_world(track, {0, 0, 0, 10 * kDegree, true}, seed);
    for (std::size_t i = 0; i < 4; ++i, ++count) {
      const Eigen::Vector3d moved_m = turned.gates[i].X_WG.translation() - nominal.gates[i].X_WG.translation();
      ASSERT_NEAR(moved_m.norm(), 0.3, 1e-12);
      ASSERT_LE(std::abs(moved_m.z()), 0.15);
      largest_rise_m = std::max(largest_rise_m, std::abs(moved_m.z()));
      mean += moved_m / 0.3;
      high += std::abs(moved_m.z()) > 0.075;
      const Eigen::Matrix3d turn = turned.gates[i].X_WG.linear() * nominal.gates[i].X_WG.linear().transpose();
      const double yaw_rad = std::atan2(turn(1, 0), turn(0, 0));
      ASSERT_NEAR(std::abs(yaw_rad), 60 * kDegree, 1e-9);
      left += yaw_rad > 0;
      ASSERT_NEAR(std::acos(leant.gates[i].X_WG.linear()(2, 2)), 10 * kDegree, 1e-9);
    }
  }
  // 1200 draws: three sigma of a fair coin are 52 of them, of the mean of unit vectors 0.06.
  EXPECT_NEAR(left, count / 2, 52);
  EXPECT_NEAR(high, count / 2, 52) << "up or down uniformly";
  EXPECT_LT(mean.norm() / count, 0.06) << "directions lean to one side";
  EXPECT_GT(largest_rise_m, 0.148);
}

TEST(Perturbation, ExactKeepsTheWaysAndSidesOfItsSeed) {
  const Track track = circle();
  const auto nominal = nominal_world(track);
  const auto turn_of = [&](const scene::World& world, std::size_t i) {
    const Eigen::Matrix3d turn = world.gates[i].X_WG.linear() * nominal.gates[i].X_WG.linear().transpose();
    return std::atan2(turn(1, 0), turn(0, 0));
  };
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const auto drawn = perturbed_world(track, {0.3, 0.1, 40 * kDegree, 0}, seed);
    const auto exact = perturbed_world(track, {0.3, 0.1, 40 * kDegree, 0, true}, seed);
    for (std::size_t i = 0; i < 4; ++i) {
      const Eigen::Vector3d a_m = drawn.gates[i].X_WG.translation() - nominal.gates[i].X_WG.translation();
      const Eigen::Vector3d b_m = exact.gates[i].X_WG.translation() - nominal.gates[i].X_WG.translation();
      EXPECT_NEAR(a_m.z(), b_m.z(), 1e-12);
      EXPECT_NEAR(a_m.head<2>().normalized().dot(b_m.head<2>().normalized()), 1.0, 1e-9);
      EXPECT_GT(turn_of(drawn, i) * turn_of(exact, i), 0.0);
    }
  }
}

TEST(Perturbation, ExactStaysExactWhereTheFloorIsInTheWay) {
  const Track track = circle();  // gates at 1.5 m, 0.75 m to their lower edges
  const auto nominal = nominal_world(track);
  int stopped = 0;
  for (std::uint64_t seed = 1; seed <= 100; ++seed) {
    const auto world = perturbed_world(track, {1.0, 1.0, 0, 0, true}, seed);
    for (std::size_t i = 0; i < 4; ++i) {
      EXPECT_GE(world.gates[i].X_WG.translation().z(), 0.75 - 1e-12);
      EXPECT_NEAR((world.gates[i].X_WG.translation() - nominal.gates[i].X_WG.translation()).norm(), 1.0, 1e-12);
      stopped += world.gates[i].X_WG.translation().z() < 0.75 + 1e-9;
    }
  }
  EXPECT_NEAR(stopped, 50, 25) << "an eighth of 400 would go deeper";
}

TEST(Perturbation, TiltLeansGatesByHalfToAllOfItsMagnitude) {
  const Track track = circle();
  for (std::uint64_t seed = 1; seed <= 20; ++seed)
    for (const auto& gate : perturbed_world(track, {0, 0, 0, 10 * kDegree}, seed).gates) {
      const double lean = std::acos(gate.X_WG.linear()(2, 2));
      EXPECT_GE(lean, 5 * kDegree - 1e-9);
      EXPECT_LE(lean, 10 * kDegree + 1e-9);
    }
}

TEST(Perturbation, GatesStayAboveTheFloor) {
  Track track = circle();
  for (std::uint64_t seed = 1; seed <= 50; ++seed)
    for (const auto& gate : perturbed_world(track, {0, 3.0, 0, 0}, seed).gates)
      EXPECT_GE(gate.X_WG.translation().z(), 0.75);
}

TEST(Perturbation, AGateThatIsPassedAgainIsDrawnOnceAndTheOthersAsIfItWereNot) {
  Track track = circle();
  const Perturbation perturbation{0.3, 0.15, 0.5, 0.1};
  const auto once = perturbed_world(track, perturbation, 11);
  // A fifth waypoint back through the first gate.
  Waypoint back = track.course.waypoints[0];
  back.direction_W = -back.direction_W;
  back.gate_id = track.course.waypoints[0].gate_id = 1;
  track.course.waypoints.push_back(back);
  const auto twice = perturbed_world(track, perturbation, 11);
  ASSERT_EQ(twice.gates.size(), 4u);
  for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(twice.gates[i].X_WG.matrix(), once.gates[i].X_WG.matrix());
  const auto passed = gates_by_waypoint(twice, track.course);
  ASSERT_EQ(passed.size(), 5u);
  EXPECT_EQ(passed[4].X_WG.translation(), passed[0].X_WG.translation());
  EXPECT_EQ(passed[4].X_WG.linear().col(0), -passed[0].X_WG.linear().col(0));
}

TEST(Mismatch, ScalesTheTrueVehicle) {
  const QuadrotorModel believed;
  const QuadrotorModel truth = true_quadrotor(believed, {1.1, 1.5, 2.0, Eigen::Vector3d::Zero()});
  EXPECT_NEAR(truth.mass_kg, 1.1 * believed.mass_kg, 1e-12);
  EXPECT_NEAR(truth.drag_kg_s.x(), 1.5 * believed.drag_kg_s.x(), 1e-12);
  EXPECT_NEAR(truth.rotor_time_constant_s, 2 * believed.rotor_time_constant_s, 1e-12);
  EXPECT_EQ(truth.thrust_max_n, believed.thrust_max_n);
  Mismatch stronger;
  stronger.thrust_factor = 1.1;
  EXPECT_NEAR(true_quadrotor(believed, stronger).thrust_max_n, 1.1 * believed.thrust_max_n, 1e-12);
}

TEST(Scenario, SaysHowTheVehicleIsDriven) {
  const auto rates = scenario_from("actuation { kind: BODY_RATES }");
  ASSERT_TRUE(rates.ok()) << rates.error();
  const Actuation usual = rates->vehicle.actuation;
  EXPECT_EQ(usual.kind, Actuation::Kind::kBodyRates);
  EXPECT_NEAR(usual.thrust_time_constant_s, 0.025, 1e-12);
  EXPECT_LT((usual.rate_time_constant_s - Eigen::Vector3d(0.0425, 0.0425, 0.08)).norm(), 1e-12);

  const auto own = scenario_from(
      "actuation { kind: BODY_RATES thrust_time_constant_s: 0.03 rate_time_constant_s { x: 0.05 y: 0.06 z: 0.2 } }");
  ASSERT_TRUE(own.ok()) << own.error();
  EXPECT_EQ(own->vehicle.actuation.rate_time_constant_s, Eigen::Vector3d(0.05, 0.06, 0.2));

  const auto half = scenario_from("actuation { kind: BODY_RATES thrust_time_constant_s: 0.03 }");
  ASSERT_FALSE(half.ok());
  EXPECT_EQ(half.failure().field, "actuation.rate_time_constant_s[0]");
}

TEST(Mismatch, OfARateLoopNeedsARateLoop) {
  const auto rates = scenario_from(
      "actuation { kind: BODY_RATES } mismatch { rate_lag_factor: 1.5 setpoint_delay_ms: 20 thrust_factor: 1.1 }");
  ASSERT_TRUE(rates.ok()) << rates.error();
  EXPECT_EQ(rates->mismatch.rate_lag_factor, 1.5);
  EXPECT_EQ(rates->mismatch.setpoint_delay, std::chrono::milliseconds(20));
  EXPECT_EQ(rates->mismatch.thrust_factor, 1.1);
  EXPECT_TRUE(scenario_from("mismatch { thrust_factor: 1.1 }").ok());

  const auto lag = scenario_from("mismatch { rate_lag_factor: 1.5 }");
  ASSERT_FALSE(lag.ok());
  EXPECT_THAT(lag.error(), HasSubstr("mismatch.rate_lag_factor is 1.5, expected 1 for a vehicle driven by rotor"));
  const auto limited = scenario_from("actuation { kind: BODY_RATES } mismatch { rate_limit_rad_s { x: 3 y: 2 z: 1 } }");
  ASSERT_TRUE(limited.ok()) << limited.error();
  EXPECT_EQ(limited->mismatch.rate_limit_rad_s, Eigen::Vector3d(3, 2, 1));
  EXPECT_EQ(scenario_from("mismatch { rate_limit_rad_s { x: 3 y: 2 z: 1 } }").failure().field,
            "mismatch.rate_limit_rad_s");
  const auto late = scenario_from("mismatch { setpoint_delay_ms: 20 }");
  ASSERT_FALSE(late.ok());
  EXPECT_EQ(late.failure().field, "mismatch.setpoint_delay_ms");
  for (const char* wrong :
       {"rate_lag_factor: 0.1", "setpoint_delay_ms: 300", "setpoint_delay_ms: -1", "thrust_factor: 0.1",
        "thrust_factor: nan", "rate_limit_rad_s { x: 0.1 y: 2 z: 2 }", "rate_limit_rad_s { x: 2 y: nan z: 2 }"})
    EXPECT_FALSE(scenario_from(std::string("actuation { kind: BODY_RATES } mismatch { ") + wrong + " }").ok()) << wrong;
}

}  // namespace
}  // namespace gatefield::config
