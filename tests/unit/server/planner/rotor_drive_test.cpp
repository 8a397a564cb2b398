// How far apart the rollouts of vehicles lie that are driven by rotor thrusts.

#include <gtest/gtest.h>

#include <cmath>

#include "server/planner/drive/drive.h"

namespace gatefield::planner {
namespace {

std::array<float, 4> sigma_n_s(const QuadrotorModel& model) { return Drive::make({}, model, {})->noise().sigma; }

TEST(RotorDrive, NoiseOfTheVehicleThatProfilesWereMadeFor) {
  const auto sigma = sigma_n_s({});
  EXPECT_EQ(sigma, (std::array<float, 4>{3.0f, 3.0f, 3.0f, 9.0f})) << "its flights stay as they are, bit for bit";
}

TEST(RotorDrive, NoiseMovesEveryVehicleAlike) {
  const QuadrotorModel racer;
  QuadrotorModel small = racer;  // of another mass, size, inertia and kind of propeller
  small.mass_kg = 0.044;
  small.inertia_kg_m2 = {2.0e-5, 2.4e-5, 3.6e-5};
  for (auto& position : small.rotor_position_B_m) position *= 0.0354 / 0.0771;
  small.torque_per_thrust_m = 0.006;
  const auto motion = [](const QuadrotorModel& model) {
    const auto sigma = sigma_n_s(model);
    const double arms_m = kRotors * std::abs(model.rotor_position_B_m[0].x());
    return Eigen::Vector4d(kRotors * sigma[0] / model.mass_kg, arms_m * sigma[1] / model.inertia_kg_m2.x(),
                           arms_m * sigma[2] / model.inertia_kg_m2.y(),
                           kRotors * model.torque_per_thrust_m * sigma[3] / model.inertia_kg_m2.z());
  };
  const Eigen::Vector4d of_racer = motion(racer), of_small = motion(small);
  for (int i = 0; i < 4; ++i) EXPECT_NEAR(of_small[i] / of_racer[i], 1.0, 1e-5) << i;
}

TEST(RotorDrive, ThrustChangesAsFastAsTheVehicleCanOrTheProfilePermits) {
  QuadrotorModel heavy;
  heavy.mass_kg = 5.0;
  heavy.thrust_max_n = 60.0;
  heavy.thrust_rate_max_n_s = 180.0;
  const double hover_n = heavy.mass_kg * kGravity_m_s2 / kRotors;
  const auto fastest_n_s = [&](double limit_s) {
    Profile profile;
    profile.rotors_change_limit_s = limit_s;
    PlanInput input;
    input.start.thrust_n = input.start.thrust_command_n = hover_thrust_n(heavy);
    Plan plan;
    const auto drive = Drive::make(profile, heavy, {});
    DrivenState state = drive->start(input);
    drive->move(input, PlainVector4::Constant(1e4), 0, &state, &plan);
    return plan.thrust_rate_n_s[0].maxCoeff();
  };
  EXPECT_NEAR(fastest_n_s(10.0), 10.0 * hover_n, 1e-6);
  EXPECT_NEAR(fastest_n_s(15.0), 180.0, 1e-6);
}

}  // namespace
}  // namespace gatefield::planner
