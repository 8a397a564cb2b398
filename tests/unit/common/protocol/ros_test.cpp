#include "common/protocol/ros.h"

#include <gtest/gtest.h>

#include <functional>
#include <limits>

#include "common/base/text.h"

namespace gatefield::ros {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN(), kInf = std::numeric_limits<double>::infinity();

Image good_image() {
  Image image;
  image.width = 3;
  image.height = 2;
  image.step_bytes = 8;
  image.encoding = "16UC1";
  image.data.resize(16);
  return image;
}

TEST(Ros, WhatIsUsualIsGood) {
  EXPECT_TRUE(validate(Odometry{}).ok());
  EXPECT_TRUE(validate(PoseStamped{}).ok());
  EXPECT_TRUE(validate(good_image()).ok());
}

TEST(Ros, EachNumberOfOdometryOutOfRangeIsNamed) {
  struct Place {
    const char* field;
    std::function<double*(Odometry*)> of;
    double beyond;
  };
  std::vector<Place> places;
  for (int i = 0; i < 3; ++i) {
    places.push_back({"pose.position", [i](Odometry* o) { return &o->pose.position[i]; }, 1.001e5});
    places.push_back({"twist.linear", [i](Odometry* o) { return &o->linear[i]; }, 200.1});
    places.push_back({"twist.angular", [i](Odometry* o) { return &o->angular[i]; }, 200.1});
  }
  for (int i = 0; i < 4; ++i)
    places.push_back({"pose.orientation", [i](Odometry* o) { return &o->pose.orientation.coeffs()[i]; }, 1.02});
  for (const Place& place : places) {
    for (const double value : {kNan, kInf, -kInf, place.beyond, -place.beyond}) {
      Odometry odometry;
      *place.of(&odometry) = value;
      const Status status = validate(odometry);
      ASSERT_FALSE(status.ok()) << place.field << " " << value;
      EXPECT_EQ(status.failure().field, place.field);
    }
  }
  Odometry odometry;
  odometry.pose.header.stamp = std::chrono::nanoseconds(-1);
  EXPECT_EQ(validate(odometry).failure().field, "header.stamp");
}

TEST(Ros, WordsOfStrangersForgeNoLines) {
  Image image = good_image();
  image.encoding = "16\nerror: \x1b[2J";
  EXPECT_TRUE(printable(validate(image).error())) << validate(image).error();
  EXPECT_TRUE(printable(validate_topic("topic", "/a\n/b").error()));
}

TEST(Ros, EachFieldOfAnImageOutOfRangeIsNamed) {
  struct Case {
    const char* field;
    std::function<void(Image*)> spoil;
  };
  for (const auto& [field, spoil] : {
           Case{"width", [](Image* i) { i->width = 0; }},
           Case{"width", [](Image* i) { i->width = 4097; }},
           Case{"height", [](Image* i) { i->height = 0; }},
           Case{"height", [](Image* i) { i->height = 4097; }},
           Case{"encoding", [](Image* i) { i->encoding = "rgb8"; }},
           Case{"encoding", [](Image* i) { i->encoding.clear(); }},
           Case{"step", [](Image* i) { i->step_bytes = 5; }},
           Case{"step", [](Image* i) { i->encoding = "32FC1"; }},
           Case{"data", [](Image* i) { i->data.pop_back(); }},
           Case{"data", [](Image* i) { i->step_bytes = std::numeric_limits<std::uint32_t>::max(); }},
           Case{"header.stamp", [](Image* i) { i->header.stamp = std::chrono::nanoseconds::min(); }},
       }) {
    Image image = good_image();
    spoil(&image);
    const Status status = validate(image);
    ASSERT_FALSE(status.ok()) << field;
    EXPECT_EQ(status.failure().field, field);
  }
}

TEST(Ros, NamesOfTopicsAreWhole) {
  for (const char* name : {"/a", "/mocap/racer_1/pose", "/_x/Y2"})
    EXPECT_TRUE(validate_topic("pose", name).ok()) << name;
  for (const char* name : {"", "/", "a", "/a/", "//a", "/a b", "/1a", "/a/2", "/a-b", "~/a", "/\xC3\xA4"})
    EXPECT_EQ(validate_topic("pose", name).failure().field, "pose") << name;
  EXPECT_FALSE(validate_topic("pose", "/" + std::string(200, 'a')).ok());
}

}  // namespace
}  // namespace gatefield::ros
