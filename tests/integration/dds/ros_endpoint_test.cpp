#include "common/dds/ros_endpoint.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <mutex>
#include <thread>

#include "tests/support/dds_domain.h"

namespace gatefield::dds {
namespace {

using namespace std::chrono_literals;

struct Heard final : RosHandler {
  std::mutex mutex;
  ros::Odometry odometry;
  ros::Image image;
  std::atomic<int> odometries{0}, poses{0}, images{0}, rejected{0};
  std::atomic<std::uint64_t> from{0};

  void on_odometry(const ros::Odometry& message, std::uint64_t program) override {
    const std::lock_guard lock(mutex);
    odometry = message;
    from = program;
    ++odometries;
  }
  void on_pose(const ros::PoseStamped&, std::uint64_t program) override {
    from = program;
    ++poses;
  }
  void on_image(ros::Image& message, std::uint64_t) override {
    const std::lock_guard lock(mutex);
    std::swap(image, message);
    ++images;
  }
  void on_rejected(RosTopic, const Error&) override { ++rejected; }
};

/// Best-effort samples may be lost: sent until seen.
template <typename Send, typename Seen>
bool until(Send&& send, Seen&& seen) {
  for (int i = 0; i < 500 && !seen(); ++i) {
    send();
    std::this_thread::sleep_for(20ms);
  }
  return seen();
}

const RosTopics kTopics{.odometry = "/t/odometry", .pose = "/t/pose", .image = "/t/depth"};

TEST(RosEndpoint, MessagesGoFromOneProgramToAnother) {
  Heard heard;
  auto listener = RosListener::open(test::own_domain(), "listener", kTopics, &heard);
  ASSERT_TRUE(listener.ok()) << listener.error();
  auto first = RosPublisher::open(test::own_domain(), "first", kTopics);
  ASSERT_TRUE(first.ok()) << first.error();

  ros::Odometry odometry;
  odometry.pose.header = {1'700'000'000'123'456'789ns, "map"};
  odometry.pose.position = {1, 2, 3};
  odometry.linear = {4, 5, 6};
  ASSERT_TRUE(until([&] { (*first)->publish(odometry); }, [&] { return heard.odometries > 0; }));
  EXPECT_EQ(heard.odometry.pose.header.stamp, odometry.pose.header.stamp);
  EXPECT_EQ(heard.odometry.linear, odometry.linear);
  EXPECT_EQ((*listener)->publishers(RosTopic::kOdometry), 1U);
  EXPECT_EQ((*first)->listeners(RosTopic::kImage), 1U);
  const std::uint64_t program = heard.from;

  ros::Image image;
  image.width = 640;
  image.height = 480;
  image.step_bytes = 4 * 640;
  image.encoding = "32FC1";
  image.data.assign(std::size_t{4} * 640 * 480, 0x3F);
  ASSERT_TRUE(until([&] { (*first)->publish(image); }, [&] { return heard.images > 0; }));
  EXPECT_EQ(heard.image.data, image.data);
  EXPECT_EQ(image.data.size(), std::size_t{4} * 640 * 480) << "lent, and given back";

  auto second =
      RosPublisher::open(test::own_domain(), "second", RosTopics{.odometry = "", .pose = "/t/pose", .image = ""});
  ASSERT_TRUE(second.ok());
  ASSERT_TRUE(until([&] { (*second)->publish(ros::PoseStamped{}); }, [&] { return heard.poses > 0; }));
  EXPECT_NE(heard.from, program) << "programs are told apart";
  EXPECT_FALSE((*second)->publish(image)) << "a topic that it was not opened for";
  EXPECT_EQ(heard.rejected, 0);
}

TEST(RosEndpoint, WhatIsOutOfRangeIsRejectedWithItsField) {
  Heard heard;
  auto listener = RosListener::open(test::own_domain(), "listener", kTopics, &heard);
  auto publisher = RosPublisher::open(test::own_domain(), "publisher", kTopics);
  ASSERT_TRUE(listener.ok() && publisher.ok());
  ros::PoseStamped pose;
  pose.orientation.coeffs() *= 2;
  ASSERT_TRUE(until([&] { (*publisher)->publish(pose); }, [&] { return heard.rejected > 0; }));
  EXPECT_EQ(heard.poses, 0);
}

TEST(RosEndpoint, NamesThatAreNoTopicsAreRefused) {
  Heard heard;
  EXPECT_EQ(RosListener::open(test::own_domain(), "x", RosTopics{.odometry = "", .pose = "pose", .image = ""}, &heard)
                .failure()
                .field,
            "pose");
  EXPECT_EQ(RosPublisher::open(test::own_domain(), "x", RosTopics{.odometry = "", .pose = "", .image = "/a//b"})
                .failure()
                .field,
            "image");
}

}  // namespace
}  // namespace gatefield::dds
