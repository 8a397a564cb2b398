#include "gatefield/sdk/publisher.h"

#include <gtest/gtest.h>

#include <limits>
#include <mutex>
#include <numbers>
#include <optional>
#include <thread>

#include "common/dds/ros_endpoint.h"
#include "tests/support/dds_domain.h"

namespace gatefield::sdk {
namespace {

using namespace std::chrono_literals;

struct Heard final : dds::RosHandler {
  std::mutex mutex;
  std::optional<ros::Odometry> odometry;
  std::optional<ros::PoseStamped> pose;
  std::optional<ros::Image> image;

  template <typename Message>
  void keep(std::optional<Message>* place, const Message& message) {
    const std::lock_guard lock(mutex);
    *place = message;
  }
  void on_odometry(const ros::Odometry& message, std::uint64_t) override { keep(&odometry, message); }
  void on_pose(const ros::PoseStamped& message, std::uint64_t) override { keep(&pose, message); }
  void on_image(ros::Image& message, std::uint64_t) override { keep(&image, message); }
  void on_rejected(dds::RosTopic, const Error& why) override { ADD_FAILURE() << why.message; }
};

class SdkPublisher : public testing::Test {
 protected:
  SdkPublisher() {
    options.domain = test::own_domain();
    options.odometry = "/t/odometry";
    options.pose = "/t/pose";
    options.depth = "/t/depth";
  }
  /// Best-effort samples may be lost: sent until heard.
  template <typename Send, typename Message>
  Message until_heard(Send&& send, std::optional<Message>* place) {
    for (int i = 0; i < 500; ++i) {
      const Status sent = send();
      EXPECT_TRUE(sent.ok()) << sent.error();
      std::this_thread::sleep_for(20ms);
      const std::lock_guard lock(heard.mutex);
      if (*place) return **place;
    }
    ADD_FAILURE() << "nothing was heard";
    return {};
  }

  PublisherOptions options;
  Heard heard;
  const Publisher::Time time{1'700'000'000s};
};

TEST_F(SdkPublisher, SpeaksAsARosNodeWould) {
  auto listener = dds::RosListener::open(
      options.domain, "listener", {.odometry = options.odometry, .pose = options.pose, .image = options.depth}, &heard);
  ASSERT_TRUE(listener.ok()) << listener.error();
  auto created = Publisher::create(options);
  ASSERT_TRUE(created.ok()) << created.error();
  Publisher& publisher = **created;
  const Pose pose{
      {1, 2, 3},
      PlainQuaternion(Eigen::Quaterniond(Eigen::AngleAxisd(std::numbers::pi / 2, Eigen::Vector3d::UnitZ())))};

  const auto odometry = until_heard(
      [&] {
        return publisher.publish_odometry(time, "map", pose, {0, 4, 0}, {0.1, 0.2, 0.3});
      },
      &heard.odometry);
  EXPECT_EQ(odometry.pose.header.stamp, time.time_since_epoch());
  EXPECT_EQ(odometry.pose.header.frame_id, "map");
  EXPECT_EQ(odometry.pose.position, pose.p_OB);
  EXPECT_TRUE(odometry.linear.isApprox(Eigen::Vector3d(4, 0, 0), 1e-12)) << "the twist is in the child's axes";
  EXPECT_EQ(odometry.angular, Eigen::Vector3d(0.1, 0.2, 0.3));

  const auto stamped = until_heard([&] { return publisher.publish_pose(time, "map", pose); }, &heard.pose);
  EXPECT_LT(stamped.orientation.angularDistance(Eigen::Quaterniond(pose.q_OB)), 1e-9);

  const std::vector<std::uint16_t> counts{1, 2, 3, 4, 5, 65535};
  const auto image = until_heard([&] { return publisher.publish_depth(time, 3, 2, std::span(counts)); }, &heard.image);
  EXPECT_EQ(image.encoding, "16UC1");
  EXPECT_EQ(image.step_bytes, 6U);
  EXPECT_EQ(image.data.size(), 12U);
  EXPECT_EQ(publisher.listeners(options.depth), 1U);
  EXPECT_EQ(publisher.listeners("/elsewhere"), 0U);
}

TEST_F(SdkPublisher, WhatABridgeWouldRefuseIsRefusedHere) {
  options.pose.clear();
  auto created = Publisher::create(options);
  ASSERT_TRUE(created.ok()) << created.error();
  Publisher& publisher = **created;
  EXPECT_EQ(publisher.publish_pose(time, "map", {}).failure().field, "pose") << "a topic without a name";
  Pose pose;
  pose.q_OB.coeffs() *= 2;
  EXPECT_EQ(publisher.publish_odometry(time, "map", pose, {0, 0, 0}, {0, 0, 0}).failure().field, "pose.orientation");
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(publisher.publish_odometry(time, "map", {}, {0, nan, 0}, {0, 0, 0}).failure().field, "twist.linear");
  const std::vector<float> metres(5);
  EXPECT_EQ(publisher.publish_depth(time, 3, 2, std::span(metres)).failure().field, "data");
}

TEST_F(SdkPublisher, NamesThatAreNoTopicsAreRefused) {
  options.depth = "depth";
  const auto created = Publisher::create(options);
  ASSERT_FALSE(created.ok());
  EXPECT_EQ(created.failure().field, "depth");
}

}  // namespace
}  // namespace gatefield::sdk
