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
  EXPECT_TRUE(vehicle->camera.X_BC.isApprox(camera.X_BC, 1e-12));
}

TEST(VehicleFile, ImpossibleValuesNameFieldValueAndRange) {
  EXPECT_THAT(error_with("mass_kg: 0.83", "mass_kg: -1"), HasSubstr("vehicle.mass_kg is -1, expected more than 0"));
  EXPECT_THAT(error_with("mass_kg: 0.83", "mass_kg: nan"), HasSubstr("vehicle.mass_kg is nan"));
  EXPECT_THAT(error_with("thrust_max_n: 10", "thrust_max_n: 1"), HasSubstr("vehicle.thrust_max_n is 1, "));
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
  EXPECT_EQ(vehicle.failure().field, "vehicle.inertia_kg_m2[2]");
  EXPECT_EQ(vehicle.failure().code, ErrorCode::kInvalid);
  EXPECT_THAT(vehicle.error(), HasSubstr("mine.txt: vehicle.inertia_kg_m2[2] is 3.5e-05, expected at most 2.86e-05"));
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
  EXPECT_EQ(vehicle.failure().field, "vehicle.rotor_spin");
  EXPECT_THAT(vehicle.error(), HasSubstr("vehicle.rotor_spin is (1, 1, 1, 1), expected spins that make yaw"));
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
  EXPECT_THAT(error_with("z: 0.25", "z: 100"), HasSubstr("vehicle.drag_kg_s[2] is 100, expected 0 to 4.15 kg/s"));
  EXPECT_EQ(error_with("z: 0.25", "z: 4.1"), "accepted");
}

}  // namespace
}  // namespace gatefield::config
