#include "common/config/vehicle.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/config/locate.h"
#include "tests/unit/common/config/temporary_file.h"

namespace gatefield::config {
namespace {

using testing::HasSubstr;

std::string racer() { return read_all(find_config("vehicles", "racer").value()); }

std::string error_with(const std::string& from, const std::string& to) {
  const std::string text = replaced(racer(), from, to);
  EXPECT_FALSE(text.empty()) << "the shipped file has no '" << from << "'";
  const TemporaryFile file(text, "mine.txt");
  const auto vehicle = load_vehicle(file.path());
  if (vehicle) return "accepted";
  EXPECT_THAT(vehicle.error(), HasSubstr("mine.txt:"));
  return vehicle.error();
}

TEST(VehicleFile, TheRacerIsTheVehicleOfTheDefaults) {
  const auto vehicle = load_vehicle(find_config("vehicles", "racer").value());
  ASSERT_TRUE(vehicle.ok()) << vehicle.error();
  const QuadrotorModel expected;
  const QuadrotorModel& model = vehicle->quadrotor;
  EXPECT_EQ(model.mass_kg, expected.mass_kg);
  EXPECT_EQ(model.inertia_kg_m2, expected.inertia_kg_m2);
  for (std::size_t i = 0; i < kRotors; ++i) EXPECT_EQ(model.rotor_position_B_m[i], expected.rotor_position_B_m[i]);
  EXPECT_EQ(model.rotor_spin, expected.rotor_spin);
  EXPECT_EQ(model.torque_per_thrust_m, expected.torque_per_thrust_m);
  EXPECT_EQ(model.thrust_min_n, expected.thrust_min_n);
  EXPECT_EQ(model.thrust_max_n, expected.thrust_max_n);
  EXPECT_EQ(model.thrust_rate_max_n_s, expected.thrust_rate_max_n_s);
  EXPECT_EQ(model.rotor_time_constant_s, expected.rotor_time_constant_s);
  EXPECT_EQ(model.drag_kg_s, expected.drag_kg_s);
  EXPECT_EQ(model.collision_radius_m, expected.collision_radius_m);
  const CameraModel camera = default_camera();
  EXPECT_EQ(vehicle->camera.width_px, camera.width_px);
  EXPECT_EQ(vehicle->camera.height_px, camera.height_px);
  EXPECT_NEAR(vehicle->camera.fx_px, camera.fx_px, 1e-9);
  EXPECT_NEAR(vehicle->camera.fy_px, camera.fy_px, 1e-9);
  EXPECT_EQ(vehicle->camera.max_depth_m, camera.max_depth_m);
  EXPECT_EQ(vehicle->camera.metres_per_count, camera.metres_per_count);
  EXPECT_EQ(vehicle->camera.distortion_model, CameraModel::Distortion::kNone);
  EXPECT_EQ(vehicle->actuation.kind, Actuation::Kind::kRotorThrusts);
  EXPECT_EQ(model.body_rate_max_rad_s, expected.body_rate_max_rad_s);
  EXPECT_TRUE(vehicle->camera.X_BC.isApprox(camera.X_BC, 1e-12));
}

TEST(VehicleFile, ImpossibleValuesNameFieldValueAndRange) {
  EXPECT_THAT(error_with("mass_kg: 0.83", "mass_kg: -1"), HasSubstr("quadrotor.mass_kg is -1, expected more than 0"));
  EXPECT_THAT(error_with("mass_kg: 0.83", "mass_kg: nan"), HasSubstr("quadrotor.mass_kg is nan"));
  EXPECT_THAT(error_with("thrust_max_n: 10", "thrust_max_n: 1"), HasSubstr("quadrotor.thrust_max_n is 1, "));
  EXPECT_THAT(error_with("torque_sign:  1", "torque_sign:  0"), HasSubstr("expected +1 or -1"));
  EXPECT_THAT(error_with("rate_hz: 60", "rate_hz: 0"), HasSubstr("camera.rate_hz is 0"));
  EXPECT_THAT(error_with("horizontal_fov_deg: 87", "horizontal_fov_deg: 190"),
              HasSubstr("camera.horizontal_fov_deg is 190"));
}

TEST(VehicleFile, MissingFieldsAreNamed) {
  EXPECT_THAT(error_with("mass_kg: 0.83", ""), HasSubstr("required field 'quadrotor.mass_kg' is missing"));
  EXPECT_THAT(error_with("vertical_fov_deg: 58", ""), HasSubstr("incomplete lens"));
  EXPECT_THAT(error_with("rotor { x_m:  0.0771 y_m: -0.0771 torque_sign:  1 }", ""),
              HasSubstr("quadrotor.rotor is given 3 times, expected exactly 4"));
}

TEST(VehicleFile, FocalLengthsInsteadOfFieldsOfViewAndAFullMount) {
  std::string text = replaced(racer(), "horizontal_fov_deg: 87", "fx_px: 90 fy_px: 91");
  text = replaced(text, "vertical_fov_deg: 58", "cx_px: 79 cy_px: 46");
  text = replaced(text, "mount { pitch_up_deg: 15 }", "mount { x_m: 0.1 yaw_left_deg: 90 }");
  const TemporaryFile file(text);
  const auto vehicle = load_vehicle(file.path());
  ASSERT_TRUE(vehicle.ok()) << vehicle.error();
  EXPECT_EQ(vehicle->camera.fy_px, 91);
  EXPECT_EQ(vehicle->camera.cx_px, 79);
  const Eigen::Vector3d looks_B = vehicle->camera.X_BC.linear() * Eigen::Vector3d::UnitZ();
  EXPECT_TRUE(looks_B.isApprox(Eigen::Vector3d::UnitY(), 1e-9)) << looks_B.transpose();
  EXPECT_EQ(vehicle->camera.X_BC.translation().x(), 0.1);
  EXPECT_THAT(error_with("horizontal_fov_deg: 87", "horizontal_fov_deg: 87 fx_px: 90"), HasSubstr("both"));
}

// Vehicles of other people, as they were written down.
constexpr const char* kCamera = R"(
camera { width_px: 160 height_px: 90 horizontal_fov_deg: 87 vertical_fov_deg: 58 min_depth_m: 0.3 max_depth_m: 10
         rate_hz: 60 mount { pitch_up_deg: 15 } }
)";

std::string crazyflie(const std::string& zz) {
  return R"(
title: "Crazyflie 2.1 (rotorpy), 30 g"
quadrotor {
  mass_kg: 0.030
  inertia_kg_m2 { xx: 1.43e-5 yy: 1.43e-5 zz: )" +
         zz + R"( }
  rotor { x_m:  0.0304 y_m: -0.0304 torque_sign:  1 }
  rotor { x_m: -0.0304 y_m:  0.0304 torque_sign:  1 }
  rotor { x_m:  0.0304 y_m:  0.0304 torque_sign: -1 }
  rotor { x_m: -0.0304 y_m: -0.0304 torque_sign: -1 }
  torque_per_thrust_m: 0.0059
  thrust_min_n: 0
  thrust_max_n: 0.144
  thrust_rate_max_n_s: 2.0
  rotor_time_constant_s: 0.072
  drag_kg_s { x: 0.01 y: 0.01 z: 0.01 }
  collision_radius_m: 0.06
})" + kCamera;
}

Result<Vehicle> load(const std::string& text) {
  const TemporaryFile file(text, "mine.txt");
  return load_vehicle(file.path());
}

TEST(VehicleFile, AMomentOfInertiaThatIsRoundedUpIsMendedAndSaid) {
  const auto rounded = load(crazyflie("2.89e-5"));  // 1.05 % above the sum of the others
  ASSERT_TRUE(rounded.ok()) << rounded.error();
  EXPECT_DOUBLE_EQ(rounded->quadrotor.inertia_kg_m2.z(), 2.86e-5);
  ASSERT_EQ(rounded->notes.size(), 1u);
  EXPECT_THAT(rounded->notes[0], HasSubstr("mine.txt: quadrotor.inertia_kg_m2.zz is 2.89e-05, taken as 2.86e-05"));
  const auto exact = load(crazyflie("2.86e-5"));
  ASSERT_TRUE(exact.ok()) << exact.error();
  EXPECT_TRUE(exact->notes.empty());
}

TEST(VehicleFile, AMomentOfInertiaThatNoBodyHasIsRefusedWithTheRule) {
  const auto vehicle = load(crazyflie("3.5e-5"));
  ASSERT_FALSE(vehicle.ok());
  EXPECT_EQ(vehicle.failure().field, "quadrotor.inertia_kg_m2[2]");
  EXPECT_EQ(vehicle.failure().code, ErrorCode::kInvalid);
  EXPECT_THAT(vehicle.error(), HasSubstr("mine.txt: quadrotor.inertia_kg_m2[2] is 3.5e-05, expected at most 2.86e-05"));
  EXPECT_THAT(vehicle.error(), HasSubstr("triangle rule"));
}

TEST(VehicleFile, LightAndHeavyVehiclesAreTaken) {
  for (const char* quadrotor : {R"(
quadrotor {
  mass_kg: 0.044
  inertia_kg_m2 { xx: 2.0e-5 yy: 2.0e-5 zz: 3.6e-5 }
  rotor { x_m:  0.0354 y_m: -0.0354 torque_sign:  1 }
  rotor { x_m: -0.0354 y_m:  0.0354 torque_sign:  1 }
  rotor { x_m:  0.0354 y_m:  0.0354 torque_sign: -1 }
  rotor { x_m: -0.0354 y_m: -0.0354 torque_sign: -1 }
  torque_per_thrust_m: 0.006
  thrust_max_n: 0.388
  thrust_rate_max_n_s: 7.0
  rotor_time_constant_s: 0.050
  drag_kg_s { x: 0.01 y: 0.01 z: 0.01 }
  collision_radius_m: 0.07
})",
                                R"(
quadrotor { mass_kg: 0.1 inertia_kg_m2 { xx: 9.111e-05 yy: 9.111e-05 zz: 1.470e-04 }
  rotor { x_m: 0.0381 y_m: -0.0381 torque_sign: 1 } rotor { x_m: -0.0381 y_m: 0.0381 torque_sign: 1 }
  rotor { x_m: 0.0381 y_m: 0.0381 torque_sign: -1 } rotor { x_m: -0.0381 y_m: -0.0381 torque_sign: -1 }
  torque_per_thrust_m: 0.0079 thrust_max_n: 1.205 thrust_rate_max_n_s: 3.614 rotor_time_constant_s: 0.025
  drag_kg_s { x: 0.0241 y: 0.0241 z: 0.0301 } collision_radius_m: 0.064 })",
                                R"(
quadrotor { mass_kg: 5 inertia_kg_m2 { xx: 6.183e-02 yy: 6.183e-02 zz: 9.972e-02 }
  rotor { x_m: 0.1403 y_m: -0.1403 torque_sign: 1 } rotor { x_m: -0.1403 y_m: 0.1403 torque_sign: 1 }
  rotor { x_m: 0.1403 y_m: 0.1403 torque_sign: -1 } rotor { x_m: -0.1403 y_m: -0.1403 torque_sign: -1 }
  torque_per_thrust_m: 0.0291 thrust_max_n: 60.241 thrust_rate_max_n_s: 180.723 rotor_time_constant_s: 0.025
  drag_kg_s { x: 1.2048 y: 1.2048 z: 1.5060 } collision_radius_m: 0.237 })"}) {
    const auto vehicle = load(std::string(quadrotor) + kCamera);
    ASSERT_TRUE(vehicle.ok()) << vehicle.error();
    EXPECT_TRUE(vehicle->notes.empty());
  }
}

TEST(VehicleFile, RotorsThatAllTurnOneWayAreRefused) {
  const auto vehicle = load(std::string(R"(
title: "agile_flight kingfisher, rotor order FR BL BR FL"
quadrotor { mass_kg: 0.752 inertia_kg_m2 { xx: 0.0025 yy: 0.0021 zz: 0.0043 }
  rotor { x_m: 0.0775 y_m: -0.1 torque_sign: 1 } rotor { x_m: -0.0775 y_m: 0.1 torque_sign: 1 }
  rotor { x_m: -0.0775 y_m: -0.1 torque_sign: 1 } rotor { x_m: 0.0775 y_m: 0.1 torque_sign: 1 }
  torque_per_thrust_m: 0.022 thrust_max_n: 8.5 thrust_rate_max_n_s: 60 rotor_time_constant_s: 0.033
  drag_kg_s { x: 0.2 y: 0.2 z: 0.2 } collision_radius_m: 0.15 })") +
                            kCamera);
  ASSERT_FALSE(vehicle.ok());
  EXPECT_EQ(vehicle.failure().field, "quadrotor.rotor_spin");
  EXPECT_THAT(vehicle.error(), HasSubstr("quadrotor.rotor_spin is (1, 1, 1, 1), expected spins that make yaw"));
}

TEST(VehicleFile, TheIntrinsicsOfALargerImageAreRefused) {
  const auto vehicle = load(R"(
quadrotor { mass_kg: 0.83 inertia_kg_m2 { xx: 3.1e-3 yy: 3.1e-3 zz: 5.0e-3 }
  rotor { x_m: 0.0771 y_m: -0.0771 torque_sign: 1 } rotor { x_m: -0.0771 y_m: 0.0771 torque_sign: 1 }
  rotor { x_m: 0.0771 y_m: 0.0771 torque_sign: -1 } rotor { x_m: -0.0771 y_m: -0.0771 torque_sign: -1 }
  torque_per_thrust_m: 0.016 thrust_max_n: 10 thrust_rate_max_n_s: 30 rotor_time_constant_s: 0.025
  drag_kg_s { x: 0.2 y: 0.2 z: 0.25 } collision_radius_m: 0.13 }
camera { width_px: 160 height_px: 120 fx_px: 382.5 fy_px: 382.5 cx_px: 320 cy_px: 240 min_depth_m: 0.3 max_depth_m: 10
         rate_hz: 60 mount { pitch_up_deg: 15 } })");
  ASSERT_FALSE(vehicle.ok());
  EXPECT_EQ(vehicle.failure().field, "camera.cx_px");
  EXPECT_THAT(vehicle.error(), HasSubstr("camera.cx_px is 320, expected 0 to 160, a principal point inside the image"));
}

TEST(VehicleFile, DragThatNoStepCanFollowIsRefused) {
  EXPECT_THAT(error_with("z: 0.25", "z: 100"), HasSubstr("quadrotor.drag_kg_s[2] is 100, expected 0 to 4.15 kg/s"));
  EXPECT_EQ(error_with("z: 0.25", "z: 4.1"), "accepted");
}

Vehicle must_load(const std::string& text) {
  auto vehicle = load(text);
  EXPECT_TRUE(vehicle.ok()) << vehicle.error();
  return std::move(vehicle).value();
}

TEST(VehicleFile, IntrinsicsOfOpenCvAndRosFitAfterAddingAHalf) {
  // There the ray through pixel (u, v) is ((u - cx) / fx, (v - cy) / fy, 1).
  constexpr double kF = 120.0, kCx = 79.5, kCy = 44.5;
  std::string text = replaced(racer(), "horizontal_fov_deg: 87", "fx_px: 120 fy_px: 120");
  text = replaced(text, "vertical_fov_deg: 58", "cx_px: 80 cy_px: 45");
  const CameraModel camera = must_load(text).camera;
  for (const auto& [u, v] : {std::pair(0, 0), std::pair(159, 89), std::pair(31, 17)})
    EXPECT_EQ(camera.ray_C(u, v), Eigen::Vector3d((u - kCx) / kF, (v - kCy) / kF, 1)) << u << ", " << v;
  EXPECT_EQ(Eigen::Vector3d(camera.ray_C(0, 0) + camera.ray_C(159, 89)), Eigen::Vector3d(0, 0, 2))
      << "the middle of 160 x 90 pixels lies between the 80th and the 81st";
}

TEST(VehicleFile, TheUnitOfDepthIsReadAndChecked) {
  EXPECT_EQ(must_load(replaced(racer(), "rate_hz: 60", "rate_hz: 60 metres_per_count: 0.0005")).camera.metres_per_count,
            0.0005);
  EXPECT_THAT(error_with("rate_hz: 60", "rate_hz: 60 metres_per_count: 1"),
              HasSubstr("camera.metres_per_count is 1, expected 1e-6 to 0.1 m"));
}

TEST(VehicleFile, DistortionIsReadAndRefusedWhereItMatters) {
  const CameraModel camera =
      must_load(
          replaced(racer(), "rate_hz: 60",
                   "rate_hz: 60 distortion { model: BROWN_CONRADY k1: 1e-3 k2: 2e-4 p1: 3e-4 p2: 4e-4 k3: 5e-5 }"))
          .camera;
  EXPECT_EQ(camera.distortion_model, CameraModel::Distortion::kBrownConrady);
  EXPECT_EQ(camera.distortion, (std::array<double, 5>{1e-3, 2e-4, 3e-4, 4e-4, 5e-5})) << "in OpenCV's order";
  EXPECT_THAT(error_with("rate_hz: 60", "rate_hz: 60 distortion { model: BROWN_CONRADY k1: -0.3 }"),
              HasSubstr("camera.distortion is one that moves a pixel by "));
  EXPECT_EQ(error_with("rate_hz: 60", "rate_hz: 60 distortion { model: NONE }"), "accepted");
  EXPECT_EQ(error_with("rate_hz: 60", "rate_hz: 60 distortion { model: NONE k1: 0 }"), "accepted");
  EXPECT_THAT(error_with("rate_hz: 60", "rate_hz: 60 distortion { model: NONE k1: -0.3 }"),
              HasSubstr("camera.distortion.model is NONE, expected BROWN_CONRADY"));
}

TEST(VehicleFile, LimitsOfBodyRatesAreReadAndChecked) {
  const auto vehicle = must_load(
      replaced(racer(), "collision_radius_m: 0.13", "collision_radius_m: 0.13 body_rate_max_rad_s { x: 9 y: 8 z: 3 }"));
  EXPECT_EQ(vehicle.quadrotor.body_rate_max_rad_s, Eigen::Vector3d(9, 8, 3));
  EXPECT_THAT(error_with("collision_radius_m: 0.13", "collision_radius_m: 0.13 body_rate_max_rad_s { x: -1 }"),
              HasSubstr("quadrotor.body_rate_max_rad_s"));
}

TEST(VehicleFile, ThePropellersRadiusIsReadCheckedAndElseTheUsualOne) {
  EXPECT_EQ(must_load(racer()).propeller_radius_m, Vehicle().propeller_radius_m);
  EXPECT_EQ(must_load(replaced(racer(), "propeller_radius_m: 0.061", "propeller_radius_m: 0.05")).propeller_radius_m,
            0.05);
  // Neighbours are 0.1542 m apart.
  EXPECT_NEAR(must_load(replaced(racer(), "propeller_radius_m: 0.061", "")).propeller_radius_m, 0.8 * 0.0771, 1e-12);
  const std::string range = " to 0.0771 m, a tenth of the longest arm to half of the shortest way between two rotors";
  for (const char* const wrong : {"0.0772", "0.0109", "-0.061", "61", "nan"})
    EXPECT_THAT(error_with("propeller_radius_m: 0.061", std::string("propeller_radius_m: ") + wrong),
                AllOf(HasSubstr("quadrotor.propeller_radius_m is "), HasSubstr(range)))
        << wrong;
}

TEST(VehicleFile, TheShippedOnesBehindARateLoopAreThoseWithoutInAllElse) {
  const auto parts = [](const std::string& name) {
    const std::string text = read_all(find_config("vehicles", name).value());
    return text.substr(text.find("quadrotor {"));
  };
  for (const std::string name : {"racer", "onboard"}) EXPECT_EQ(parts(name + "-rates").find(parts(name)), 0u) << name;
}

TEST(VehicleFile, TheKindOfActuationIsReadAndChecked) {
  const auto with = [](const std::string& actuation) { return racer() + "\nactuation { " + actuation + " }\n"; };
  const Actuation rates =
      must_load(with("kind: BODY_RATES thrust_time_constant_s: 0.03 rate_time_constant_s { x: 0.02 y: 0.02 z: 0.1 }"))
          .actuation;
  EXPECT_EQ(rates.kind, Actuation::Kind::kBodyRates);
  EXPECT_EQ(rates.thrust_time_constant_s, 0.03);
  EXPECT_EQ(rates.rate_time_constant_s, Eigen::Vector3d(0.02, 0.02, 0.1));
  EXPECT_EQ(must_load(with("kind: ROTOR_THRUSTS")).actuation.kind, Actuation::Kind::kRotorThrusts);

  const auto incomplete = load(with("kind: BODY_RATES thrust_time_constant_s: 0.03"));
  ASSERT_FALSE(incomplete.ok());
  EXPECT_EQ(incomplete.failure().field, "actuation.rate_time_constant_s[0]");
  EXPECT_THAT(incomplete.error(), HasSubstr("actuation.rate_time_constant_s[0] is 0 s, expected 0.001 to 1 s"));
  const auto rotors = load(with("thrust_time_constant_s: 0.03"));
  ASSERT_FALSE(rotors.ok());
  EXPECT_THAT(rotors.error(), HasSubstr("expected 0 for a vehicle driven by rotor thrusts"));
}

}  // namespace
}  // namespace gatefield::config
