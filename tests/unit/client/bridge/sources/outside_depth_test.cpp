#include "client/bridge/sources/outside_depth.h"

#include <gmock/gmock.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

namespace gatefield::bridge::sources {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::HasSubstr;

constexpr std::chrono::nanoseconds kWall = 1'700'000'000s;  // when the loop's clock says 100 s
const Moment kMoment{100s, kWall};

CameraModel camera() {
  CameraModel made = default_camera();
  made.width_px = 2;
  made.height_px = 2;
  return made;
}

template <typename Pixel>
ros::Image image(const std::string& encoding, const std::vector<Pixel>& pixels, std::uint32_t padding = 0) {
  ros::Image made;
  made.header.stamp = kWall - 20ms;
  made.width = made.height = 2;
  made.encoding = encoding;
  made.big_endian = std::endian::native == std::endian::big;
  made.step_bytes = 2 * sizeof(Pixel) + padding;
  made.data.assign(std::size_t{2} * made.step_bytes, 0xEE);
  for (std::size_t row = 0; row < 2; ++row)
    std::memcpy(&made.data[row * made.step_bytes], &pixels[2 * row], 2 * sizeof(Pixel));
  return made;
}

const std::vector<std::uint16_t> kCounts{1000, 0, 2500, 65535};

TEST(OutsideDepth, MillimetresGoOnAsTheyAreWithoutTheRowsPadding) {
  OutsideDepth depth({.image = "/depth"}, camera());
  EXPECT_FALSE(depth.next(0ms));
  for (const std::uint32_t padding : {0u, 4u}) {
    ros::Image message = image("16UC1", kCounts, padding);
    message.header.stamp += std::chrono::milliseconds(padding);
    depth.on_image(kMoment, message, 1);
    const auto frame = depth.next(0ms);
    ASSERT_TRUE(frame);
    EXPECT_EQ(frame->capture, 100s - 20ms + std::chrono::milliseconds(padding));
    EXPECT_THAT(std::get<std::span<const std::uint16_t>>(frame->pixels), ElementsAre(1000, 0, 2500, 65535));
  }
  EXPECT_FALSE(depth.next(0ms)) << "each frame is given once";
}

TEST(OutsideDepth, BytesInTheOtherOrderAreTurned) {
  OutsideDepth depth({.image = "/depth"}, camera());
  ros::Image message = image("mono16", kCounts);
  for (std::size_t i = 0; i < message.data.size(); i += 2) std::swap(message.data[i], message.data[i + 1]);
  message.big_endian = !message.big_endian;
  depth.on_image(kMoment, message, 1);
  EXPECT_THAT(std::get<std::span<const std::uint16_t>>(depth.next(0ms)->pixels), ElementsAre(1000, 0, 2500, 65535));
}

TEST(OutsideDepth, WhatIsNoDistanceBecomesNoReturn) {
  OutsideDepth depth({.image = "/depth"}, camera());
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN(), kInf = std::numeric_limits<float>::infinity();
  ros::Image message = image<float>("32FC1", {1.5F, kNan, kInf, -2.0F});
  depth.on_image(kMoment, message, 1);
  EXPECT_THAT(std::get<std::span<const float>>(depth.next(0ms)->pixels), ElementsAre(1.5F, 0.0F, 0.0F, 0.0F));
}

TEST(OutsideDepth, MillimetresBecomeMetresWhereTheCameraCountsOtherwise) {
  CameraModel counting = camera();
  counting.metres_per_count = 2.5e-4;
  OutsideDepth depth({.image = "/depth"}, counting);
  ros::Image message = image("16UC1", kCounts);
  depth.on_image(kMoment, message, 1);
  EXPECT_THAT(std::get<std::span<const float>>(depth.next(0ms)->pixels), ElementsAre(1.0F, 0.0F, 2.5F, 65.535F));
}

TEST(OutsideDepth, AnotherSizeIsRefusedAndTold) {
  OutsideDepth depth({.image = "/depth"}, default_camera());
  ros::Image message = image("16UC1", kCounts);
  depth.on_image(kMoment, message, 1);
  EXPECT_FALSE(depth.next(0ms));
  EXPECT_THAT(depth.admission().complaint("/depth")->message,
              HasSubstr("image is 2 x 2, expected 160 x 90, the camera's size in the vehicle file"));
}

TEST(OutsideDepth, OfFramesThatWaitTheNewestCounts) {
  OutsideDepth depth({.image = "/depth"}, camera());
  for (int i = 0; i < 3; ++i) {
    ros::Image message = image("16UC1", kCounts);
    message.header.stamp += std::chrono::milliseconds(i);
    depth.on_image(kMoment, message, 1);
  }
  EXPECT_EQ(depth.next(0ms)->capture, 100s - 18ms);
  EXPECT_FALSE(depth.next(1ms));
}

}  // namespace
}  // namespace gatefield::bridge::sources
