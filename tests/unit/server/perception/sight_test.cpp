#include "server/perception/sight.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "tests/unit/server/pilot/fakes.h"

namespace gatefield::perception {
namespace {

namespace testing = pilot::testing;
using testing::FakeSensor;

std::vector<std::uint8_t> metres(std::initializer_list<float> values) {
  std::vector<std::uint8_t> bytes(values.size() * 4);
  std::memcpy(bytes.data(), values.begin(), bytes.size());
  return bytes;
}
std::vector<std::uint8_t> counts(std::initializer_list<std::uint16_t> values) {
  std::vector<std::uint8_t> bytes(values.size() * 2);
  std::memcpy(bytes.data(), values.begin(), bytes.size());
  return bytes;
}

TEST(DecodeDepth, TurnsEverythingOutOfRangeIntoNoReturn) {
  const CameraModel camera = default_camera();  // 0.3 to 10 m
  std::vector<float> depth_m;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float infinity = std::numeric_limits<float>::infinity();
  const DecodedDepth floats =
      decode_depth({metres({1.5f, 0.0f, nan, infinity, -2.0f, 0.2f, 12.0f, 10.0f}), protocol::DepthEncoding::kMetres32},
                   camera, &depth_m);
  EXPECT_THAT(depth_m, ::testing::ElementsAre(1.5f, 0, 0, 0, 0, 0, 0, 10.0f));
  EXPECT_EQ(floats.returns, 2u);
  EXPECT_EQ(floats.saturated, 2u);

  const DecodedDepth integers =
      decode_depth({counts({1500, 0, 299, 10001, 65535, 300}), protocol::DepthEncoding::kCounts16}, camera, &depth_m);
  EXPECT_THAT(depth_m, ::testing::ElementsAre(::testing::FloatEq(1.5f), 0, 0, 0, 0, ::testing::FloatEq(0.3f)));
  EXPECT_EQ(integers.returns, 2u);
  EXPECT_EQ(integers.saturated, 2u);
}

class SightTest : public ::testing::Test {
 protected:
  SightTest() : request_(testing::join_request()) {
    request_.camera.X_BC = forward_camera_mount(0.0);  // looks along x
    sight_ = std::make_unique<Sight>(request_.camera, request_.course, std::make_unique<FakeSensor>(sensor_),
                                     SightOptions{});
  }
  bool seen(std::uint32_t waypoint) const { return sight_->records().seen(waypoint); }
  void see(std::uint32_t waypoint, const Eigen::Vector3d& center_W) {
    gates::GateMeasurement measurement;
    measurement.X_WG.translation() = center_W;
    ASSERT_TRUE(sight_->records().take(waypoint, &measurement, std::chrono::milliseconds(900)));
  }
  Sight::Outcome look(const Eigen::Vector3d& p_WB, std::uint32_t target = 0, std::uint32_t next = 1,
                      std::uint16_t mm = 4000, double yaw_rad = 0.0) {
    Eigen::Isometry3d X_WB = Eigen::Isometry3d::Identity();
    X_WB.translation() = p_WB;
    X_WB.linear() = Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
    const protocol::DepthFrame frame = testing::depth_frame(request_, 1, 1, std::chrono::seconds(1), mm);
    return sight_->look(frame.pixels, frame.encoding, frame.stamp, X_WB, target, next);
  }

  protocol::SessionRequest request_;
  std::shared_ptr<FakeSensor::Script> sensor_ = std::make_shared<FakeSensor::Script>();
  std::unique_ptr<Sight> sight_;
};

TEST_F(SightTest, LooksForTheTargetWhereItsWaypointIs) {
  EXPECT_EQ(look({0, 0, 1.5}), Sight::Outcome::kLooked);  // the next gate, 11 m ahead, is out of range
  ASSERT_EQ(sensor_->calls, 1);
  EXPECT_LT((*sensor_->priors[0] - Eigen::Vector3d(0, 0, 5)).norm(), 1e-9);
  EXPECT_EQ(sensor_->pixels, 32u * 18u);
  EXPECT_TRUE(seen(0));
  EXPECT_LT((sight_->records().expected_center_W(0) - Eigen::Vector3d(5, 0, 1.5)).norm(), 1e-6);
}

TEST_F(SightTest, LooksForTheNextGateToo) {
  look({3, 0, 1.5});
  EXPECT_EQ(sensor_->calls, 2);
  EXPECT_TRUE(seen(1));
}

TEST_F(SightTest, BeliefReplacesTheWaypointOnceSeen) {
  see(0, {5, 0.5, 1.5});
  look({0, 0, 1.5});
  EXPECT_LT((*sensor_->priors[0] - Eigen::Vector3d(-0.5, 0, 5)).norm(), 1e-9);  // left of the axis: -x of the camera
}

TEST_F(SightTest, FirstSightFallsBackToTheWholeImage) {
  sensor_->validity = 0.1f;
  sensor_->center_C = Eigen::Vector3d(-1.0, 0, 5);  // 1 m beside the waypoint
  look({0, 0, 1.5});
  ASSERT_EQ(sensor_->calls, 2);
  EXPECT_FALSE(sensor_->priors[1].has_value());
  EXPECT_TRUE(seen(0));
}

TEST_F(SightTest, AGateFarFromTheWaypointIsAnotherGate) {
  sensor_->validity = 0.1f;
  sensor_->center_C = Eigen::Vector3d(-1.9, 0, 5);
  look({0, 0, 1.5});
  EXPECT_EQ(sensor_->calls, 2);
  EXPECT_FALSE(seen(0));
}

TEST_F(SightTest, ASeenGateIsNotSearchedElsewhere) {
  see(0, {5, 0, 1.5});
  sensor_->validity = 0.1f;
  look({0, 0, 1.5});
  EXPECT_EQ(sensor_->calls, 1);
}

TEST_F(SightTest, AnUnseenTargetOutOfViewIsSearchedOnlyWhenNear) {
  look({0, 0, 1.5}, 0, 0, 4000, 1.6);  // looks away to the left
  EXPECT_EQ(sensor_->calls, 1);
  EXPECT_FALSE(sensor_->priors[0].has_value());
  sensor_->priors.clear();
  look({-10, 0, 1.5}, 0, 0, 4000, 1.6);  // 15 m away
  EXPECT_TRUE(sensor_->priors.empty());
}

TEST_F(SightTest, SensorsThatCantBeSteeredAreAskedOnce) {
  sensor_->steerable = false;
  sensor_->validity = 0.1f;
  look({0, 0, 1.5});
  EXPECT_EQ(sensor_->calls, 1);
}

TEST_F(SightTest, AGateThatIsNextInTheOtherDirectionIsLookedForOnce) {
  request_.course.waypoints.resize(1);
  request_.course.waypoints[0].gate_id = 1;
  request_.course.waypoints.push_back(request_.course.waypoints[0]);
  request_.course.waypoints[1].direction_W = -Eigen::Vector3d::UnitX();
  sight_ =
      std::make_unique<Sight>(request_.camera, request_.course, std::make_unique<FakeSensor>(sensor_), SightOptions{});
  look({0, 0, 1.5});
  EXPECT_EQ(sensor_->calls, 1);
  EXPECT_TRUE(seen(1));
}

TEST_F(SightTest, ImagesWithNothingInThemAreNotLookedAt) {
  EXPECT_EQ(look({0, 0, 1.5}, 0, 1, 0), Sight::Outcome::kEmpty);
  EXPECT_EQ(look({0, 0, 1.5}, 0, 1, 65535), Sight::Outcome::kSaturated);
  EXPECT_EQ(look({0, 0, 1.5}, 0, 1, 20000), Sight::Outcome::kSaturated);
  EXPECT_EQ(sensor_->calls, 0);
}

}  // namespace
}  // namespace gatefield::perception
