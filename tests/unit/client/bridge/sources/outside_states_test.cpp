#include "client/bridge/sources/outside_states.h"

#include <gmock/gmock.h>

#include <numbers>

namespace gatefield::bridge::sources {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

constexpr std::chrono::nanoseconds kWall = 1'700'000'000s;  // when the loop's clock says 100 s
constexpr std::uint64_t kProgram = 5;

Moment at(Stamp since) { return {100s + since, kWall + since}; }

Eigen::Quaterniond turned(const Eigen::Vector3d& axis, double angle_rad) {
  return Eigen::Quaterniond(Eigen::AngleAxisd(angle_rad, axis.normalized()));
}

StateOptions options() {
  StateOptions made;
  made.odometry = "/odometry";
  return made;
}

ros::Odometry odometry(Stamp since) {
  ros::Odometry made;
  made.pose.header.stamp = kWall + since;
  return made;
}

TEST(OutsideStates, TheTwistOfOdometryIsInTheChildFrame) {
  OutsideStates states(options());
  EXPECT_FALSE(states.newest(100s));
  ros::Odometry message = odometry(0ms);
  message.pose.position = {1, 2, 3};
  message.pose.orientation = turned(Eigen::Vector3d::UnitZ(), std::numbers::pi / 2);
  message.linear = {4, 0, 0};
  message.angular = {0.1, 0.2, 0.3};
  states.on_odometry(at(2ms), message, kProgram);
  const auto state = states.newest(100s);
  ASSERT_TRUE(state);
  EXPECT_EQ(state->stamp, 100s);
  EXPECT_FALSE(state->thrust_known);
  EXPECT_TRUE(state->state.p_WB.isApprox(Eigen::Vector3d(1, 2, 3)));
  EXPECT_TRUE(state->state.v_WB.isApprox(Eigen::Vector3d(0, 4, 0), 1e-12)) << state->state.v_WB.transpose();
  EXPECT_TRUE(state->state.w_WB_B.isApprox(Eigen::Vector3d(0.1, 0.2, 0.3)));
  EXPECT_EQ(states.velocity_lag(), 0ms);
}

/// A motion of the vehicle in the world, as a source in another frame sees markers that are mounted askew.
struct Motion {
  StateOptions options = sources::options();
  Eigen::Quaterniond q_WB = turned({1, -2, 0.5}, 0.8);
  Eigen::Vector3d p_WB{3, -1, 2}, v_WB{2, 1, -0.5}, w_WB_B{1, -2, 3};

  Motion() {
    options.p_WO = {10, 20, 0.5};
    options.yaw_WO_rad = 0.7;
    options.p_MB = {0.1, -0.02, -0.05};
    options.rpy_MB_rad = {0.2, -0.1, 1.5};
  }
  ros::Odometry seen(Stamp since) const {
    const Eigen::Quaterniond q_WO = turned(Eigen::Vector3d::UnitZ(), options.yaw_WO_rad);
    const Eigen::Quaterniond q_MB = turned(Eigen::Vector3d::UnitZ(), 1.5) * turned(Eigen::Vector3d::UnitY(), -0.1) *
                                    turned(Eigen::Vector3d::UnitX(), 0.2);
    const Eigen::Quaterniond q_WM = q_WB * q_MB.conjugate();
    const Eigen::Vector3d r_W = -(q_WM * options.p_MB);  // from the centre of mass to the markers' origin
    ros::Odometry message = odometry(since);
    message.pose.orientation = q_WO.conjugate() * q_WM;
    message.pose.position = q_WO.conjugate() * (p_WB + r_W - options.p_WO);
    message.linear = q_WM.conjugate() * (v_WB + (q_WB * w_WB_B).cross(r_W));
    message.angular = q_MB * w_WB_B;
    return message;
  }
  void expect_in(const flight::TimedState& state, double tolerance) const {
    EXPECT_TRUE(state.state.p_WB.isApprox(p_WB, tolerance)) << state.state.p_WB.transpose();
    EXPECT_TRUE(state.state.v_WB.isApprox(v_WB, tolerance)) << state.state.v_WB.transpose();
    EXPECT_TRUE(state.state.w_WB_B.isApprox(w_WB_B, tolerance)) << state.state.w_WB_B.transpose();
    EXPECT_LT(Eigen::Quaterniond(state.state.q_WB).angularDistance(q_WB), tolerance);
  }
};

TEST(OutsideStates, FramesAndTheMountingOfTheMarkersAreTakenOff) {
  const Motion motion;
  OutsideStates states(motion.options);
  states.on_odometry(at(1ms), motion.seen(0ms), kProgram);
  ASSERT_TRUE(states.newest(100s));
  motion.expect_in(*states.newest(100s), 1e-9);
}

TEST(OutsideStates, OfPosesTheVelocitiesAreMade) {
  Motion motion;
  motion.options.odometry.clear();
  motion.options.pose = "/pose";
  OutsideStates states(motion.options);
  const Eigen::Vector3d p_0 = motion.p_WB;
  const Eigen::Quaterniond q_0 = motion.q_WB;
  for (Stamp t{0}; t <= 100ms; t += 4ms) {
    motion.p_WB = p_0 + motion.v_WB * seconds(t);
    motion.q_WB = q_0 * turned(motion.w_WB_B, motion.w_WB_B.norm() * seconds(t));
    states.on_pose(at(t + 1ms), motion.seen(t).pose, kProgram);
    EXPECT_EQ(states.newest(100s).has_value(), t >= 16ms) << "at " << seconds(t);
  }
  motion.expect_in(*states.newest(100s), 1e-6);
  EXPECT_EQ(std::chrono::round<std::chrono::milliseconds>(states.velocity_lag()), 14ms);
}

TEST(OutsideStates, AnotherFrameIsRefused) {
  StateOptions told = options();
  told.frame_id = "map";
  OutsideStates states(told);
  ros::Odometry message = odometry(0ms);
  message.pose.header.frame_id = "odom";
  states.on_odometry(at(1ms), message, kProgram);
  EXPECT_FALSE(states.newest(100s));
  EXPECT_THAT(states.admission().complaint("/odometry")->message,
              HasSubstr("header.frame_id is 'odom', expected 'map'"));
  message.pose.header.frame_id = "map";
  states.on_odometry(at(1ms), message, kProgram);
  EXPECT_TRUE(states.newest(100s));
}

TEST(OutsideStates, WhatIsRefusedLeavesTheStateThatWasThere) {
  OutsideStates states(options());
  states.on_odometry(at(1ms), odometry(0ms), kProgram);
  ros::Odometry later = odometry(-400ms);
  later.pose.position.x() = 9;
  states.on_odometry(at(5ms), later, kProgram);
  states.on_rejected(Error::invalid("twist.linear", "nan", "numbers"));
  EXPECT_EQ(states.newest(100s)->state.p_WB.x(), 0);
  EXPECT_EQ(states.admission().refused(Refusal::kOld), 1U);
  EXPECT_EQ(states.admission().refused(Refusal::kMalformed), 1U);
}

}  // namespace
}  // namespace gatefield::bridge::sources
