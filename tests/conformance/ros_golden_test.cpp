// Messages of ROS 2 as bytes, both ways, against files that were made without our code (golden.py).

#include <gtest/gtest.h>

#include "common/dds/ros_convert.h"
#include "common/dds/wire_type.h"
#include "gatefield_idl/rosPubSubTypes.h"
#include "tests/support/wire_bytes.h"

namespace gatefield::dds {
namespace {

using eprosima::fastrtps::rtps::SerializedPayload_t;
using OdometryType = nav_msgs::msg::dds_::Odometry_PubSubType;
using PoseType = geometry_msgs::msg::dds_::PoseStamped_PubSubType;
using ImageType = sensor_msgs::msg::dds_::Image_PubSubType;

template <typename Generated>
std::vector<std::uint8_t> bytes_of(typename Generated::type* sample) {
  WireType<Generated> type;
  SerializedPayload_t payload(type.getSerializedSizeProvider(sample)());
  EXPECT_TRUE(type.serialize(sample, &payload));
  return {payload.data, payload.data + payload.length};
}

template <typename Generated>
bool read(const std::vector<std::uint8_t>& bytes, typename Generated::type* sample) {
  WireType<Generated> type;
  SerializedPayload_t payload(static_cast<std::uint32_t>(bytes.size()));
  std::copy(bytes.begin(), bytes.end(), payload.data);
  payload.length = static_cast<std::uint32_t>(bytes.size());
  return type.deserialize(&payload, sample);
}

ros::Header header() { return {std::chrono::nanoseconds(1'700'000'000'250'000'000), "map"}; }

ros::PoseStamped pose() {
  ros::PoseStamped made;
  made.header = header();
  made.position = {1.5, -2.5, 0.25};
  made.orientation = Eigen::Quaterniond(0.5, 0.5, -0.5, 0.5);
  return made;
}

ros::Odometry odometry() {
  ros::Odometry made;
  made.pose = pose();
  made.child_frame_id = "base_link";
  made.linear = {3.0, 0.125, -1.0};
  made.angular = {0.25, -0.75, 2.0};
  return made;
}

void expect_same(const ros::PoseStamped& a, const ros::PoseStamped& b) {
  EXPECT_EQ(a.header.stamp, b.header.stamp);
  EXPECT_EQ(a.header.frame_id, b.header.frame_id);
  EXPECT_EQ(a.position, b.position);
  EXPECT_EQ(a.orientation.coeffs(), b.orientation.coeffs());
}

TEST(RosGolden, PoseStamped) {
  const auto expected = test::wire_bytes("ros_pose_stamped");
  PoseType::type sample;
  to_wire(pose(), &sample);
  EXPECT_EQ(bytes_of<PoseType>(&sample), expected);
  PoseType::type read_back;
  ASSERT_TRUE(read<PoseType>(expected, &read_back));
  ros::PoseStamped message;
  ASSERT_TRUE(from_wire(&read_back, &message).ok());
  expect_same(message, pose());
}

TEST(RosGolden, Odometry) {
  const auto expected = test::wire_bytes("ros_odometry");
  OdometryType::type sample;
  to_wire(odometry(), &sample);
  EXPECT_EQ(bytes_of<OdometryType>(&sample), expected);
  OdometryType::type read_back;
  ASSERT_TRUE(read<OdometryType>(expected, &read_back));
  ros::Odometry message;
  ASSERT_TRUE(from_wire(&read_back, &message).ok());
  expect_same(message.pose, odometry().pose);
  EXPECT_EQ(message.child_frame_id, "base_link");
  EXPECT_EQ(message.linear, odometry().linear);
  EXPECT_EQ(message.angular, odometry().angular);
}

TEST(RosGolden, Image) {
  ros::Image image;
  image.header = header();
  image.height = 2;
  image.width = 3;
  image.encoding = "16UC1";
  image.step_bytes = 8;
  for (int i = 0; i < 16; ++i) image.data.push_back(static_cast<std::uint8_t>(5 * i));
  const auto expected = test::wire_bytes("ros_image");
  ImageType::type sample;
  header_to_wire(image, &sample);
  sample.data(image.data);
  EXPECT_EQ(bytes_of<ImageType>(&sample), expected);
  ImageType::type read_back;
  ASSERT_TRUE(read<ImageType>(expected, &read_back));
  ros::Image message;
  ASSERT_TRUE(from_wire(&read_back, &message).ok());
  EXPECT_EQ(message.width, 3U);
  EXPECT_EQ(message.height, 2U);
  EXPECT_EQ(message.step_bytes, 8U);
  EXPECT_EQ(message.encoding, "16UC1");
  EXPECT_EQ(message.data, image.data);
}

TEST(RosGolden, WhatIsCutOffOrClaimsTooMuchIsRefused) {
  for (const char* name : {"ros_image", "ros_odometry", "ros_pose_stamped"}) {
    const auto whole = test::wire_bytes(name);
    for (std::size_t size = 0; size < whole.size(); ++size) {
      const std::vector<std::uint8_t> cut(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size));
      ImageType::type image;
      OdometryType::type odometry;
      PoseType::type pose;
      EXPECT_FALSE(name == std::string("ros_image")      ? read<ImageType>(cut, &image)
                   : name == std::string("ros_odometry") ? read<OdometryType>(cut, &odometry)
                                                         : read<PoseType>(cut, &pose))
          << name << " of " << size << " bytes";
    }
  }
  auto claims = test::wire_bytes("ros_image");
  std::fill_n(claims.end() - 20, 4, std::uint8_t{0xFF});  // the count of its bytes
  ImageType::type image;
  EXPECT_FALSE(read<ImageType>(claims, &image));
}

TEST(RosGolden, TheLengthOfAQuaternionIsTakenOff) {
  PoseType::type sample;
  to_wire(pose(), &sample);
  sample.pose().orientation().w(0.506);
  ros::PoseStamped message;
  ASSERT_TRUE(from_wire(&sample, &message).ok());
  EXPECT_NEAR(message.orientation.norm(), 1.0, 1e-12);
}

TEST(RosGolden, ASecondHasABillionNanoseconds) {
  PoseType::type sample;
  to_wire(pose(), &sample);
  sample.header().stamp().nanosec(1'000'000'000);
  ros::PoseStamped message;
  EXPECT_EQ(from_wire(&sample, &message).failure().field, "header.stamp.nanosec");
}

}  // namespace
}  // namespace gatefield::dds
