#include "client/bridge/px4/stamp_check.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <string>

namespace gatefield::bridge {
namespace {

using namespace std::chrono_literals;

constexpr Stamp kWall = std::chrono::hours(24 * 365 * 56);

/// A message that is `age` old when it comes at `now`.
std::optional<Stamp> at(StampCheck* check, Stamp now, Stamp age, Stamp wall = kWall) {
  return check->ours({now, wall + now}, static_cast<std::uint64_t>((wall + now - age) / 1us));
}

TEST(StampCheck, OursIsNowLessTheAge) {
  StampCheck check({});
  EXPECT_EQ(at(&check, 1s, 4ms), 1s - 4ms);
  EXPECT_EQ(check.trouble(), StampCheck::Trouble::kNone);
}

TEST(StampCheck, AWallClockThatIsSetCostsNothing) {
  StampCheck check({});
  EXPECT_EQ(at(&check, 1s, 4ms), 1s - 4ms);
  EXPECT_EQ(at(&check, 1100ms, 5ms, kWall + 3h), 1100ms - 5ms);
}

TEST(StampCheck, OneMessageThatWasHeldUpIsNoClockThatIsOff) {
  StampCheck check({});
  for (Stamp now = 1s; now < 3s; now += 10ms) (void)at(&check, now, 2ms);
  EXPECT_EQ(at(&check, 3s, 80ms), 3s - 80ms);
  EXPECT_EQ(check.trouble(), StampCheck::Trouble::kNone);
}

TEST(StampCheck, WhenAllAreLateForASecondTheClockIsOff) {
  StampCheck check({});
  for (Stamp now = 1s; now < 3s; now += 10ms) (void)at(&check, now, 2ms);
  Stamp refused_after = 0s;
  for (Stamp now = 3s; now < 6s && refused_after == 0s; now += 10ms)
    if (!at(&check, now, 40ms)) refused_after = now - 3s;
  EXPECT_GE(refused_after, 1s);
  EXPECT_LE(refused_after, 2100ms);
  EXPECT_EQ(check.trouble(), StampCheck::Trouble::kLate);
  EXPECT_EQ(check.least_age(), 40ms);
}

TEST(StampCheck, AfterAGapTheOldAgesCountNoMore) {
  StampCheck check({});
  EXPECT_TRUE(at(&check, 1s, 2ms));
  EXPECT_FALSE(at(&check, 60s, 100ms));
  EXPECT_TRUE(at(&check, 61s, 1ms));
}

TEST(StampCheck, ItsOwnWordOfAnUnsettledClockCountsThreeTimesInARow) {
  StampCheck check({});
  px4::TimesyncStatus message;
  message.timestamp = 1;
  message.observed_offset = 70'000;
  message.estimated_offset = 20'000;
  check.on_timesync(message);
  check.on_timesync(message);
  EXPECT_TRUE(at(&check, 1s, 1ms));
  check.on_timesync(message);
  EXPECT_FALSE(at(&check, 1010ms, 1ms));
  EXPECT_EQ(check.trouble(), StampCheck::Trouble::kUnsettled);
  EXPECT_EQ(check.own_error(), 50ms);
  message.observed_offset = 21'000;
  check.on_timesync(message);
  EXPECT_TRUE(at(&check, 1020ms, 1ms));
}

TEST(StampCheck, TheGroundStationsClockIsNotTheAgents) {
  StampCheck check({});
  px4::TimesyncStatus message;
  message.source_protocol = 1;
  message.observed_offset = 5'000'000;
  for (int i = 0; i < 5; ++i) check.on_timesync(message);
  EXPECT_EQ(check.trouble(), StampCheck::Trouble::kNone);
}

TEST(StampCheck, StampsAtTheEndsOfTheirRangeDoNoHarm) {
  StampCheck check({});
  EXPECT_FALSE(check.ours({1s, kWall}, 1));
  EXPECT_FALSE(check.ours({1s, kWall}, 9'000'000'000'000'000));
  EXPECT_EQ(check.trouble(), StampCheck::Trouble::kEarly);
}

TEST(StampCheck, EveryTroubleHasASentenceWithTheNextStep) {
  const StampOptions options;
  EXPECT_TRUE(describe(StampCheck::Trouble::kNone, 0s, 0s, options).ok());
  EXPECT_NE(describe(StampCheck::Trouble::kSinceBoot, 0s, 0s, options).error().find("UXRCE_DDS_SYNCT"),
            std::string::npos);
  EXPECT_NE(describe(StampCheck::Trouble::kLate, 40ms, 0s, options)
                .error()
                .find("clock.error is 40 ms, expected -5 ms "
                      "to 20 ms"),
            std::string::npos);
  EXPECT_NE(describe(StampCheck::Trouble::kUnsettled, 0s, 50ms, options).error().find("50 ms"), std::string::npos);
}

}  // namespace
}  // namespace gatefield::bridge
