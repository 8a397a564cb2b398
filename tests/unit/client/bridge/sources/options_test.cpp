#include "client/bridge/sources/options.h"

#include <gtest/gtest.h>

#include <functional>
#include <limits>

namespace gatefield::bridge::sources {
namespace {

using namespace std::chrono_literals;

StateOptions good() {
  StateOptions options;
  options.pose = "/mocap/racer/pose";
  return options;
}

TEST(SourceOptions, WhatIsUsualIsTaken) {
  EXPECT_TRUE(validate(good()).ok());
  EXPECT_TRUE(validate(DepthOptions{.image = "/camera/depth/image_rect_raw"}).ok());
}

TEST(SourceOptions, EachFieldOutOfRangeIsNamed) {
  struct Case {
    const char* field;
    std::function<void(StateOptions*)> spoil;
  };
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  for (const auto& [field, spoil] : {
           Case{"odometry", [](StateOptions* o) { o->pose.clear(); }},
           Case{"odometry", [](StateOptions* o) { o->odometry = "/x"; }},
           Case{"pose", [](StateOptions* o) { o->pose = "mocap/pose"; }},
           Case{"pose", [](StateOptions* o) { o->pose = "/mocap//pose"; }},
           Case{"pose", [](StateOptions* o) { o->pose = "/mocap/0"; }},
           Case{"pose", [](StateOptions* o) { o->pose = "/mocap/"; }},
           Case{"p_WO", [](StateOptions* o) { o->p_WO.x() = kNan; }},
           Case{"p_WO", [](StateOptions* o) { o->p_WO.z() = 1.1e5; }},
           Case{"yaw_WO_rad", [](StateOptions* o) { o->yaw_WO_rad = 6.3; }},
           Case{"yaw_WO_rad", [](StateOptions* o) { o->yaw_WO_rad = kNan; }},
           Case{"p_MB", [](StateOptions* o) { o->p_MB.y() = -1.1; }},
           Case{"rpy_MB_rad", [](StateOptions* o) { o->rpy_MB_rad.y() = 7; }},
           Case{"velocity_window", [](StateOptions* o) { o->velocity_window = 4ms; }},
           Case{"velocity_window", [](StateOptions* o) { o->velocity_window = 201ms; }},
           Case{"time.oldest", [](StateOptions* o) { o->time.oldest = 4ms; }},
           Case{"time.oldest", [](StateOptions* o) { o->time.oldest = 1001ms; }},
           Case{"time.delay", [](StateOptions* o) { o->time.delay = 1ms; }},
           Case{"time.delay", [](StateOptions* o) { o->time = {.from = TimeOptions::From::kArrival, .delay = 201ms}; }},
       }) {
    StateOptions options = good();
    spoil(&options);
    const Status status = validate(options);
    ASSERT_FALSE(status.ok()) << field;
    EXPECT_EQ(status.failure().field, field);
  }
  EXPECT_EQ(validate(DepthOptions{}).failure().field, "image");
}

}  // namespace
}  // namespace gatefield::bridge::sources
