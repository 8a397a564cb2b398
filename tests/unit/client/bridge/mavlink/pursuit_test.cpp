#include "client/bridge/mavlink/pursuit.h"

#include <gtest/gtest.h>

#include <utility>

namespace gatefield::bridge {
namespace {

using namespace std::chrono_literals;
using flight::Wanted;
using Step = Pursuit::Step;

/// Setpoints every 10 ms until `now`.
void stream(Pursuit* pursuit, Stamp from, Stamp now) {
  for (Stamp at = from; at <= now; at += 10ms) pursuit->on_setpoint(at);
}

TEST(Pursuit, EntersTheModeThenArmsAfterASecondOfSetpoints) {
  Pursuit pursuit;
  EXPECT_TRUE(pursuit.want(Wanted::kArmed));
  EXPECT_FALSE(pursuit.want(Wanted::kArmed)) << "the same wish";
  EXPECT_EQ(pursuit.next(0s, false, false), Step::kNothing);
  stream(&pursuit, 0s, 990ms);
  EXPECT_EQ(pursuit.next(990ms, false, false), Step::kNothing);
  stream(&pursuit, 1s, 1s);
  EXPECT_EQ(pursuit.next(1s, false, false), Step::kEnterMode);
  EXPECT_EQ(pursuit.next(1s, true, false), Step::kEnterMode);
  EXPECT_EQ(pursuit.next(1s, false, true), Step::kArm);
  EXPECT_EQ(pursuit.next(1s, true, true), Step::kNothing);
}

TEST(Pursuit, AGapBeginsTheStreamAnew) {
  Pursuit pursuit;
  pursuit.want(Wanted::kArmed);
  stream(&pursuit, 0s, 2s);
  EXPECT_EQ(pursuit.next(2300ms, false, false), Step::kNothing) << "setpoints have ended";
  stream(&pursuit, 2300ms, 2500ms);
  EXPECT_EQ(pursuit.next(2500ms, false, false), Step::kNothing);
  stream(&pursuit, 2510ms, 3300ms);
  EXPECT_EQ(pursuit.next(3300ms, false, false), Step::kEnterMode);
}

TEST(Pursuit, WhatSomebodyTookIsAskedForAgainOnlyAfterAnotherWish) {
  Pursuit pursuit;
  pursuit.want(Wanted::kArmed);
  stream(&pursuit, 0s, 2s);
  EXPECT_EQ(pursuit.next(2s, true, true), Step::kNothing);
  EXPECT_FALSE(pursuit.taken_away());
  EXPECT_EQ(pursuit.next(2s, true, false), Step::kNothing);
  EXPECT_TRUE(pursuit.taken_away());
  EXPECT_EQ(pursuit.next(2s, true, true), Step::kNothing);
  EXPECT_TRUE(pursuit.taken_away());
  EXPECT_TRUE(pursuit.want(Wanted::kReleased));
  EXPECT_FALSE(pursuit.taken_away());
  pursuit.want(Wanted::kArmed);
  EXPECT_EQ(pursuit.next(2s, false, false), Step::kEnterMode);
}

TEST(Pursuit, DisarmsAndKillsWhatIsArmed) {
  Pursuit pursuit;
  for (const auto& [wanted, step] :
       {std::pair(Wanted::kDisarmed, Step::kDisarm), std::pair(Wanted::kKilled, Step::kKill)}) {
    pursuit.want(wanted);
    EXPECT_EQ(pursuit.next(0s, true, false), step);
    EXPECT_EQ(pursuit.next(0s, false, true), Step::kNothing);
  }
  pursuit.want(Wanted::kReleased);
  EXPECT_EQ(pursuit.next(0s, true, true), Step::kNothing);
}

}  // namespace
}  // namespace gatefield::bridge
