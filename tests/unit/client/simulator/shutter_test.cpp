#include "client/simulator/shutter.h"

#include <gtest/gtest.h>

#include <set>
#include <vector>

namespace gatefield::simulator {
namespace {

using namespace std::chrono_literals;

Eigen::Isometry3d at(Stamp now) {
  Eigen::Isometry3d X_WB = Eigen::Isometry3d::Identity();
  X_WB.translation().x() = 1e3 * seconds(now);  // a metre a millisecond
  return X_WB;
}

struct Out {
  Stamp when{0};
  Shutter::Frame frame;
};

std::vector<Out> run(Shutter shutter, Stamp begin, Stamp span) {
  std::vector<Out> out;
  for (Stamp now = begin; now <= begin + span; now += 1ms)
    if (const auto frame = shutter.step(now, at(now))) out.push_back({now, *frame});
  return out;
}

TEST(Shutter, WithoutErrorsAFrameIsOnePoseAndOutAtOnce) {
  const auto out = run(Shutter({}, from_seconds(1.0 / 60), 1), 10s, 1s);
  EXPECT_EQ(out.size(), 60u);
  EXPECT_EQ(out.front().when, 10s);
  EXPECT_EQ(out[1].when, 10s + 17ms) << "the first whole millisecond";
  EXPECT_EQ(out[2].when, 10s + 34ms);
  for (const Out& one : out) {
    EXPECT_EQ(one.frame.count, 1u);
    EXPECT_EQ(one.frame.stamp, one.when);
    EXPECT_EQ(one.frame.middle().translation(), at(one.when).translation());
  }
}

TEST(Shutter, ADelayLeavesStampAndPoseWhereTheyWere) {
  config::CameraErrors camera;
  camera.delay = 30ms;
  const auto easy = run(Shutter({}, 20ms, 1), 10s, 970ms), late = run(Shutter(camera, 20ms, 1), 10s, 1s);
  ASSERT_EQ(late.size(), easy.size());
  for (std::size_t i = 0; i < late.size(); ++i) {
    EXPECT_EQ(late[i].when, easy[i].when + 30ms);
    EXPECT_EQ(late[i].frame.stamp, easy[i].frame.stamp);
    EXPECT_EQ(late[i].frame.middle().translation(), easy[i].frame.middle().translation());
  }
}

TEST(Shutter, AnExposureHasPosesFromItsBeginToItsEnd) {
  config::CameraErrors camera;
  camera.exposure = 8ms;
  const auto out = run(Shutter(camera, 20ms, 1), 10s, 200ms);
  ASSERT_GT(out.size(), 5u);
  EXPECT_EQ(out[3].when, 10s + 64ms) << "when the exposure is over";
  const auto poses = out[3].frame.poses();
  ASSERT_EQ(poses.size(), Shutter::kPoses);
  for (std::size_t i = 0; i < poses.size(); ++i)
    EXPECT_EQ(poses[i].translation(), at(10s + 56ms + 2ms * static_cast<int>(i)).translation());
  EXPECT_EQ(out[3].frame.stamp, 10s + 60ms);
  EXPECT_EQ(out[3].frame.middle().translation(), at(10s + 60ms).translation());
}

TEST(Shutter, StampsAreOffBothWaysButTheSameAllFlightLong) {
  config::CameraErrors camera;
  camera.stamp_error = 5ms;
  std::set<Stamp> seen;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const auto out = run(Shutter(camera, 20ms, seed), 10s, 200ms);
    for (const Out& one : out) EXPECT_EQ(one.frame.stamp - one.when, out.front().frame.stamp - out.front().when);
    seen.insert(out.front().frame.stamp - out.front().when);
  }
  EXPECT_EQ(seen, (std::set<Stamp>{-5ms, 5ms}));
}

TEST(Shutter, FramesThatASlipTookAreNotMadeUpFor) {
  Shutter shutter({}, 20ms, 1);
  EXPECT_TRUE(shutter.step(10s, at(10s)));
  EXPECT_TRUE(shutter.step(11s, at(11s)));
  EXPECT_TRUE(shutter.step(11s + 1ms, at(11s + 1ms))) << "the one that is due";
  EXPECT_FALSE(shutter.step(11s + 2ms, at(11s + 2ms)));
}

}  // namespace
}  // namespace gatefield::simulator
