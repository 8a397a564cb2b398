#include "server/tools/identify.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>

#include "common/base/random.h"

namespace gatefield::tools {
namespace {

using ::testing::HasSubstr;

Actuation told() { return {Actuation::Kind::kBodyRates, 0.025, {0.04, 0.04, 0.08}}; }

/// What a vehicle truly is, against what is told.
struct Truth {
  double thrust = 1.0, lag = 1.0, limit_rad_s = 1e9;
};

/// Twelve seconds by commands that change at random, a line every 10 ms.
std::vector<RecordedState> flight(const Truth& truth, double size_rad_s = 2.0) {
  const QuadrotorModel model;
  Actuation true_drive = told();
  true_drive.rate_time_constant_s *= truth.lag;
  Random random(5);
  std::vector<RecordedState> recording(1200);
  QuadrotorState state;
  state.thrust_n = state.thrust_command_n = hover_thrust_n(model);
  RateCommand asked = hover_command(model);
  for (std::size_t i = 0; i < recording.size(); ++i) {
    if (i % 25 == 0) {
      asked[0] = model.mass_kg * kGravity_m_s2 * (1.0 + 0.2 * random.normal());
      for (int axis = 1; axis < 4; ++axis) asked[axis] = size_rad_s * random.normal();
    }
    recording[i] = {std::chrono::milliseconds(10 * i), state, asked};
    RateCommand taken = asked;
    for (int axis = 1; axis < 4; ++axis) taken[axis] = std::clamp(asked[axis], -truth.limit_rad_s, truth.limit_rad_s);
    state = step_body_rates(model, true_drive, state, taken, taken, 0.01, truth.thrust);
  }
  return recording;
}

protocol::IdentifiedDrive found(const Truth& truth) {
  return identify(flight(truth), QuadrotorModel{}, told(), {9, 9, 6}).drive;
}

TEST(Identify, FindsThrustLagsAndLimitsThatAreNotAsTold) {
  for (const double thrust : {0.85, 1.0, 1.2}) EXPECT_NEAR(found({.thrust = thrust}).thrust_factor, thrust, 0.03);
  for (const double lag : {0.7, 1.0, 1.6}) {
    const auto drive = found({.lag = lag});
    for (int axis = 0; axis < 3; ++axis)
      EXPECT_NEAR(drive.rate_time_constant_s[axis], lag * told().rate_time_constant_s[axis],
                  0.08 * lag * told().rate_time_constant_s[axis]);
    EXPECT_TRUE(drive.rate_limit_rad_s.isZero(0.0)) << drive.rate_limit_rad_s.transpose();
  }
  const auto drive = found({.lag = 1.3, .limit_rad_s = 1.5});
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(drive.rate_limit_rad_s[axis], 1.5, 0.12) << axis;
    EXPECT_NEAR(drive.rate_time_constant_s[axis], 1.3 * told().rate_time_constant_s[axis],
                0.2 * told().rate_time_constant_s[axis])
        << "a clamped command is no slow loop";
  }
}

TEST(Identify, GapsAreLeftOut) {
  auto recording = flight({});
  recording.erase(recording.begin() + 400, recording.begin() + 600);
  const Identified identified = identify(recording, QuadrotorModel{}, told(), {9, 9, 6});
  EXPECT_NEAR(identified.flown_s, 9.98, 0.011);
  EXPECT_NEAR(identified.drive.thrust_factor, 1.0, 0.03);
}

TEST(Identify, GivesLinesForAVehicleFile) {
  Identified identified;
  EXPECT_THAT(vehicle_lines(identified, QuadrotorModel{}, told()), HasSubstr("thrust: not known"));
  EXPECT_THAT(vehicle_lines(identified, QuadrotorModel{}, told()), HasSubstr("none was met"));
  identified.drive = {1.25, {0.032, 0.04, 0.0}, {0.0, 2.5, 0.0}};
  EXPECT_EQ(vehicle_lines(identified, QuadrotorModel{}, told()),
            "# thrust: 1.250 of what was asked for. Mend the thrust curve (throttle for a thrust), or, where that is "
            "right, in quadrotor { }:\n"
            "#   mass_kg: 0.664\n"
            "# in quadrotor { }; 0 where no limit was met\n"
            "body_rate_max_rad_s { x: 0 y: 2.5 z: 0 }\n"
            "actuation {\n"
            "  kind: BODY_RATES\n"
            "  thrust_time_constant_s: 0.025  # as told\n"
            "  rate_time_constant_s { x: 0.0400 y: 0.0500 z: 0.0800 }  # as told, it hardly turned: z\n"
            "}\n");
}

class RecordingFile : public ::testing::Test {
 protected:
  RecordingFile() : file_(std::filesystem::temp_directory_path() / ("recording-" + std::to_string(::getpid()))) {}
  ~RecordingFile() override { std::filesystem::remove(file_); }
  Result<std::vector<RecordedState>> read(const std::string& text) const {
    std::ofstream(file_) << text;
    return read_recording(file_);
  }
  static inline const std::string kHeader =
      "t_s,gate,vx_m_s,vy_m_s,vz_m_s,qw,qx,qy,qz,wx_rad_s,wy_rad_s,wz_rad_s,collective_n,wx_asked_rad_s,"
      "wy_asked_rad_s,wz_asked_rad_s\n";
  std::filesystem::path file_;
};

TEST_F(RecordingFile, IsReadByTheNamesOfItsColumns) {
  const auto recording =
      read(kHeader +
           "0.01,7,1,2,3,1,0,0,0,4,5,6,8.5,7,8,9\r\n0.01,7,9,9,9,1,0,0,0,4,5,6,8.5,7,8,9\n0.02,x,1,2,3.5,1,0,0,"
           "0,4,5,6,8.5,7,8,9\n\n");
  ASSERT_TRUE(recording.ok()) << recording.error();
  ASSERT_EQ(recording->size(), 2u) << "two lines of one time count once";
  EXPECT_EQ(recording->at(0).stamp, std::chrono::milliseconds(10));
  EXPECT_EQ(recording->at(0).state.v_WB, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(recording->at(0).state.w_WB_B, Eigen::Vector3d(4, 5, 6));
  EXPECT_EQ(recording->at(0).asked, RateCommand(8.5, 7, 8, 9));
}

TEST_F(RecordingFile, ThatIsNoneIsRefusedWithASentence) {
  const std::string good = "0.01,7,1,2,3,1,0,0,0,4,5,6,8.5,7,8,9\n";
  const auto why = [&](const std::string& text) {
    const auto recording = read(text);
    return recording.ok() ? "taken" : recording.error();
  };
  EXPECT_THAT(read_recording("/nowhere/flight.csv").error(), HasSubstr("/nowhere/flight.csv"));
  EXPECT_THAT(why("a,b\n1,2\n"), HasSubstr(":1: the first line names no column 't_s'"));
  EXPECT_THAT(why(""), HasSubstr("names no column 't_s'"));
  EXPECT_THAT(why(kHeader + good), HasSubstr("fewer than two moments"));
  EXPECT_THAT(why(kHeader + good + "0.02,7,1,2,3,1,0,0,0,4,oops,6,8.5,7,8,9\n"),
              HasSubstr(":3: wy_rad_s is 'oops', expected a number"));
  EXPECT_THAT(why(kHeader + good + "0.02,7,1,2,3,1,0,0,0,4\n"), HasSubstr(":3: wy_rad_s is nan"));
  EXPECT_THAT(why(kHeader + good + "0.02,7,1,2,300,1,0,0,0,4,5,6,8.5,7,8,9\n"), HasSubstr(":3: vz_m_s is 300"));
  EXPECT_THAT(why(kHeader + good + "0.02,7,1,2,3,0.5,0,0,0,4,5,6,8.5,7,8,9\n"), HasSubstr(":3: q is of norm 0.5"));
  EXPECT_THAT(why(kHeader + good + "0.005,7,1,2,3,1,0,0,0,4,5,6,8.5,7,8,9\n"), HasSubstr(":3: t_s is 0.005"));
}

}  // namespace
}  // namespace gatefield::tools
