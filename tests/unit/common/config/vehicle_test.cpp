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
  EXPECT_THAT(error_with("mass_kg: 0.83", "mass_kg: -1"),
              HasSubstr("vehicle.mass_kg is -1.000000, expected more than 0"));
  EXPECT_THAT(error_with("mass_kg: 0.83", "mass_kg: nan"), HasSubstr("vehicle.mass_kg is nan"));
  EXPECT_THAT(error_with("thrust_max_n: 10", "thrust_max_n: 1"), HasSubstr("vehicle.thrust_max_n is 1.0"));
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

}  // namespace
}  // namespace gatefield::config
