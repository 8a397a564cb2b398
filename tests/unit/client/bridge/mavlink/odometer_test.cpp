#include "client/bridge/mavlink/odometer.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "client/flight/frames.h"

namespace gatefield::bridge {
namespace {

using namespace std::chrono_literals;
using flight::ned_from_enu;

constexpr Stamp kNow = 100s;

/// A vehicle in flight, in our axes.
QuadrotorState flying() {
  QuadrotorState state;
  state.p_WB = {1, 2, 3};
  state.v_WB = {4, -5, 0.5};
  state.q_WB = Eigen::Quaterniond(Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized()));
  state.w_WB_B = {0.1, -0.2, 0.3};
  return state;
}

/// What an autopilot says of it.
mavlink::Odometry odometry(const QuadrotorState& state, std::uint8_t child_frame) {
  const Eigen::Vector3d p_N = ned_from_enu(state.p_WB);
  const Eigen::Quaterniond q_NF = flight::ned_frd_from_enu_flu(Eigen::Quaterniond(state.q_WB));
  const Eigen::Vector3d v =
      child_frame == 12 ? Eigen::Vector3d(q_NF.inverse() * ned_from_enu(state.v_WB)) : ned_from_enu(state.v_WB);
  const Eigen::Vector3d w = flight::frd_from_flu(state.w_WB_B);
  mavlink::Odometry message;
  message.frame_id = 1;
  message.child_frame_id = child_frame;
  message.x = static_cast<float>(p_N.x());
  message.y = static_cast<float>(p_N.y());
  message.z = static_cast<float>(p_N.z());
  for (std::size_t i = 0; i < 4; ++i) message.q[i] = static_cast<float>(flight::wxyz(q_NF)[i]);
  message.vx = static_cast<float>(v.x());
  message.vy = static_cast<float>(v.y());
  message.vz = static_cast<float>(v.z());
  message.rollspeed = static_cast<float>(w.x());
  message.pitchspeed = static_cast<float>(w.y());
  message.yawspeed = static_cast<float>(w.z());
  return message;
}

mavlink::LocalPositionNed position(const QuadrotorState& state) {
  const auto whole = odometry(state, 1);
  return {0, whole.x, whole.y, whole.z, whole.vx, whole.vy, whole.vz};
}

mavlink::AttitudeQuaternion attitude(const QuadrotorState& state) {
  const auto whole = odometry(state, 1);
  return {0, whole.q[0], whole.q[1], whole.q[2], whole.q[3], whole.rollspeed, whole.pitchspeed, whole.yawspeed, {}};
}

void expect_near(const QuadrotorState& a, const QuadrotorState& b, double tolerance = 1e-5) {
  EXPECT_LE((a.p_WB - b.p_WB).norm(), tolerance);
  EXPECT_LE((a.v_WB - b.v_WB).norm(), tolerance);
  EXPECT_LE((a.w_WB_B - b.w_WB_B).norm(), tolerance);
  EXPECT_LE(Eigen::Quaterniond(a.q_WB).angularDistance(Eigen::Quaterniond(b.q_WB)), std::max(tolerance, 1e-3));
}

TEST(Odometer, TurnsOdometryIntoOurAxes) {
  for (const std::uint8_t child_frame : {std::uint8_t{1}, std::uint8_t{12}, std::uint8_t{20}}) {
    Odometer odometer({});
    ASSERT_EQ(odometer.on_odometry(kNow, kNow - 5ms, odometry(flying(), child_frame)), NoState::kNone);
    ASSERT_TRUE(odometer.newest());
    EXPECT_EQ(odometer.newest()->stamp, kNow - 5ms);
    EXPECT_FALSE(odometer.newest()->thrust_known);
    expect_near(odometer.newest()->state, flying());
    EXPECT_EQ(odometer.age(), 5ms);
  }
}

TEST(Odometer, PutsTheLocalFrameIntoTheWorldOfTheCourse) {
  OdometerOptions options;
  options.frame.p_WL = {10, 20, 0.5};
  options.frame.yaw_WL_rad = std::numbers::pi / 2;
  Odometer odometer(options);
  QuadrotorState level;
  level.p_WB = {1, 0, 2};
  level.v_WB = {3, 0, 0};
  ASSERT_EQ(odometer.on_odometry(kNow, kNow, odometry(level, 1)), NoState::kNone);
  QuadrotorState expected;
  expected.p_WB = {10, 21, 2.5};
  expected.v_WB = {0, 3, 0};
  expected.q_WB = Eigen::Quaterniond(Eigen::AngleAxisd(std::numbers::pi / 2, Eigen::Vector3d::UnitZ()));
  expect_near(odometer.newest()->state, expected);
}

TEST(Odometer, RefusesAxesItDoesNotUnderstand) {
  Odometer odometer({});
  auto message = odometry(flying(), 1);
  message.frame_id = 21;  // local FLU
  EXPECT_EQ(odometer.on_odometry(kNow, kNow, message), NoState::kFrame);
  message = odometry(flying(), 1);
  message.child_frame_id = 8;
  EXPECT_EQ(odometer.on_odometry(kNow, kNow, message), NoState::kFrame);
  EXPECT_FALSE(odometer.newest());
  EXPECT_EQ(odometer.refused(NoState::kFrame), 2U);
}

TEST(Odometer, RefusesAFailedEstimate) {
  Odometer odometer({});
  auto message = odometry(flying(), 1);
  message.quality = -1;
  EXPECT_EQ(odometer.on_odometry(kNow, kNow, message), NoState::kQuality);
}

TEST(Odometer, RefusesStampsThatAreFarOff) {
  Odometer odometer({});
  EXPECT_EQ(odometer.on_odometry(kNow, kNow + 40ms, odometry(flying(), 1)), NoState::kFuture);
  EXPECT_EQ(odometer.wrong_age(), -40ms);
  EXPECT_EQ(odometer.on_odometry(kNow, kNow - 500ms, odometry(flying(), 1)), NoState::kOld);
  EXPECT_EQ(odometer.wrong_age(), 500ms);
  EXPECT_FALSE(odometer.newest());
  EXPECT_EQ(odometer.on_odometry(kNow, kNow - 1ms, odometry(flying(), 1)), NoState::kNone);
  EXPECT_EQ(odometer.on_odometry(kNow, kNow - 2ms, odometry(flying(), 1)), NoState::kNotRising);
  EXPECT_EQ(odometer.on_odometry(kNow, kNow - 1ms, odometry(flying(), 1)), NoState::kNotRising);
}

TEST(Odometer, CountsJumpsOfTheEstimate) {
  Odometer odometer({});
  auto message = odometry(flying(), 1);
  message.reset_counter = 3;
  for (int i = 0; i < 3; ++i) (void)odometer.on_odometry(kNow + i * 10ms, kNow + i * 10ms, message);
  EXPECT_EQ(odometer.jumps(), 0U);
  message.reset_counter = 4;
  (void)odometer.on_odometry(kNow + 30ms, kNow + 30ms, message);
  EXPECT_EQ(odometer.jumps(), 1U);
}

TEST(Odometer, PairsPositionAndAttitude) {
  Odometer odometer({});
  EXPECT_EQ(odometer.on_position(kNow, kNow, position(flying())), NoState::kNotPaired);
  EXPECT_FALSE(odometer.newest());
  EXPECT_EQ(odometer.on_attitude(kNow, kNow, attitude(flying())), NoState::kNone);
  ASSERT_TRUE(odometer.newest());
  expect_near(odometer.newest()->state, flying());
}

TEST(Odometer, CarriesTheOlderOneOfAPairForward) {
  Odometer later_attitude({});
  (void)later_attitude.on_position(kNow, kNow, position(flying()));
  ASSERT_EQ(later_attitude.on_attitude(kNow + 20ms, kNow + 20ms, attitude(flying())), NoState::kNone);
  EXPECT_EQ(later_attitude.newest()->stamp, kNow + 20ms);
  QuadrotorState expected = flying();
  expected.p_WB += 0.02 * expected.v_WB;
  expect_near(later_attitude.newest()->state, expected);

  Odometer later_position({});
  QuadrotorState turning = flying();
  turning.w_WB_B = {0, 0, 10};
  (void)later_position.on_attitude(kNow, kNow, attitude(turning));
  ASSERT_EQ(later_position.on_position(kNow + 20ms, kNow + 20ms, position(turning)), NoState::kNone);
  expected = turning;
  expected.q_WB = Eigen::Quaterniond(turning.q_WB) * Eigen::AngleAxisd(0.2, Eigen::Vector3d::UnitZ());
  expect_near(later_position.newest()->state, expected);
}

TEST(Odometer, PairsNothingThatLiesFarApart) {
  Odometer odometer({});
  (void)odometer.on_position(kNow, kNow, position(flying()));
  EXPECT_EQ(odometer.on_attitude(kNow + 80ms, kNow + 80ms, attitude(flying())), NoState::kNotPaired);
  EXPECT_TRUE(odometer.attitude()) << "the attitude is known all the same";
  EXPECT_FALSE(odometer.newest());
}

TEST(Odometer, PrefersOdometryWhileItComes) {
  Odometer odometer({});
  QuadrotorState other = flying();
  other.p_WB.x() += 1;
  (void)odometer.on_odometry(kNow, kNow, odometry(flying(), 1));
  (void)odometer.on_position(kNow + 10ms, kNow + 10ms, position(other));
  (void)odometer.on_attitude(kNow + 10ms, kNow + 10ms, attitude(other));
  EXPECT_EQ(odometer.newest()->stamp, kNow);
  const Stamp later = kNow + 10ms + Odometer::kOdometryLost;
  (void)odometer.on_position(later, later, position(other));
  (void)odometer.on_attitude(later, later, attitude(other));
  EXPECT_EQ(odometer.newest()->stamp, later);
}

TEST(Odometer, TakesTheOneKindItIsToldTo) {
  OdometerOptions options;
  options.from = StateFrom::kOdometry;
  Odometer one(options);
  (void)one.on_position(kNow, kNow, position(flying()));
  EXPECT_EQ(one.on_attitude(kNow, kNow, attitude(flying())), NoState::kNone);
  EXPECT_FALSE(one.newest());
  options.from = StateFrom::kLocalPosition;
  Odometer two(options);
  EXPECT_EQ(two.on_odometry(kNow, kNow, odometry(flying(), 1)), NoState::kNone);
  EXPECT_FALSE(two.newest());
}

TEST(OdometerOptions, AreChecked) {
  EXPECT_TRUE(validate(OdometerOptions{}).ok());
  OdometerOptions options;
  options.frame.p_WL.x() = std::nan("");
  EXPECT_EQ(validate(options).failure().field, "state.p_WL");
  options = {};
  options.frame.yaw_WL_rad = 7;
  EXPECT_EQ(validate(options).failure().field, "state.yaw_WL_rad");
  options = {};
  options.oldest = 1ms;
  EXPECT_EQ(validate(options).failure().field, "state.oldest");
}

}  // namespace
}  // namespace gatefield::bridge
