#include "server/pilot/time_line.h"

#include <gtest/gtest.h>

#include <limits>
#include <vector>

namespace gatefield::pilot {
namespace {

using namespace std::chrono_literals;
using Verdict = TimeLine::Verdict;

constexpr std::uint64_t kHugeSequence = std::numeric_limits<std::uint64_t>::max();
constexpr Stamp kHugeStamp = Stamp::max();

/// A line with states 1 to 10, 10 ms apart, received as they were stamped.
TimeLine ten_states() {
  TimeLine line;
  for (int i = 1; i <= 10; ++i) {
    const Verdict verdict = line.judge(static_cast<std::uint64_t>(i), i * 10ms, i * 10ms, false);
    EXPECT_EQ(verdict, Verdict::kNext) << i;
  }
  return line;
}

TEST(TimeLine, TakesWhatGoesOnAlsoOverGaps) {
  TimeLine line = ten_states();
  EXPECT_EQ(line.judge(14, 140ms, 140ms, false), Verdict::kNext);
  EXPECT_EQ(line.judge(20, 5140ms, 5100ms, false), Verdict::kNext) << "an outage passes for the receiver, too";
  EXPECT_EQ(line.last_sequence(), 20u);
  EXPECT_EQ(line.last_stamp(), 5140ms);
}

TEST(TimeLine, KnowsRepeatedAndLateSamplesHoweverManyComeInARow) {
  TimeLine line = ten_states();
  EXPECT_EQ(line.judge(10, 100ms, 101ms, false), Verdict::kRepeated);
  for (const std::uint64_t i : {5u, 6u, 7u, 8u, 9u})
    EXPECT_EQ(line.judge(i, static_cast<std::int64_t>(i) * 10ms, 101ms, false), Verdict::kLate) << i;
  EXPECT_EQ(line.judge(11, 110ms, 110ms, false), Verdict::kNext);
}

TEST(TimeLine, OneSampleFarOffCostsNothing) {
  for (const auto& [sequence, stamp] : std::vector<std::pair<std::uint64_t, Stamp>>{
           {11, kHugeStamp}, {kHugeSequence, 110ms}, {kHugeSequence, kHugeStamp}, {11, 3s}, {11, 0ns}}) {
    TimeLine line = ten_states();
    EXPECT_EQ(line.judge(sequence, stamp, 110ms, false), Verdict::kOff);
    EXPECT_EQ(line.judge(12, 120ms, 120ms, false), Verdict::kNext);
  }
}

TEST(TimeLine, OffSamplesThatDontAgreeNeverMakeALine) {
  TimeLine line = ten_states();
  for (std::uint64_t i = 11; i < 60; ++i) {
    EXPECT_EQ(line.judge(kHugeSequence - i, kHugeStamp - i * 1s, 100ms, false), Verdict::kOff);
    EXPECT_EQ(line.judge(i, static_cast<std::int64_t>(i) * 10ms, static_cast<std::int64_t>(i) * 10ms, false),
              Verdict::kNext);
  }
}

TEST(TimeLine, AClockThatBeginsAnewIsTakenUpAfterThree) {
  TimeLine line;
  for (int i = 1; i <= 10; ++i) line.judge(static_cast<std::uint64_t>(i), 500s + i * 10ms, i * 10ms, false);
  EXPECT_EQ(line.judge(11, 0ms, 110ms, false), Verdict::kOff);
  EXPECT_EQ(line.judge(12, 10ms, 120ms, false), Verdict::kOff);
  EXPECT_EQ(line.judge(13, 20ms, 130ms, false), Verdict::kNewLine);
  EXPECT_EQ(line.judge(14, 30ms, 140ms, false), Verdict::kNext);
}

TEST(TimeLine, AClockThatStepsBackALittleIsTakenUpAfterThree) {
  TimeLine line = ten_states();
  EXPECT_EQ(line.judge(11, 30ms, 110ms, false), Verdict::kOff);
  EXPECT_EQ(line.judge(12, 40ms, 120ms, false), Verdict::kOff);
  EXPECT_EQ(line.judge(13, 50ms, 130ms, false), Verdict::kNewLine);
}

TEST(TimeLine, ACountThatBeginsAnewIsTakenUpAfterThree) {
  TimeLine line = ten_states();
  EXPECT_EQ(line.judge(1, 110ms, 110ms, false), Verdict::kOff);
  EXPECT_EQ(line.judge(2, 120ms, 120ms, false), Verdict::kOff);
  EXPECT_EQ(line.judge(3, 130ms, 130ms, false), Verdict::kNewLine);
}

TEST(TimeLine, ABadFirstSampleIsLeftBehind) {
  TimeLine line;
  EXPECT_EQ(line.judge(kHugeSequence, 1000s, 0ms, false), Verdict::kNext);
  EXPECT_EQ(line.judge(1, 10ms, 10ms, false), Verdict::kOff);
  EXPECT_EQ(line.judge(2, 20ms, 20ms, false), Verdict::kOff);
  EXPECT_EQ(line.judge(3, 30ms, 30ms, false), Verdict::kNewLine);
}

TEST(TimeLine, AStampThatLeavesNoRoomForMoreLiesOnNoLine) {
  TimeLine line;
  EXPECT_EQ(line.judge(1, kHugeStamp, 0ms, false), Verdict::kOff);
  EXPECT_FALSE(line.begun());
  EXPECT_EQ(line.judge(1, TimeLine::kMaxStamp, 0ms, false), Verdict::kNext);
  EXPECT_EQ(line.judge(2, TimeLine::kMaxStamp + 1ns, 10ms, false), Verdict::kOff);
}

TEST(TimeLine, AClientThatWaitsForItsAnswerAgreesWithItself) {
  TimeLine line = ten_states();
  EXPECT_EQ(line.judge(11, 0ms, 110ms, true), Verdict::kOff);
  EXPECT_EQ(line.judge(11, 0ms, 210ms, true), Verdict::kOff);
  EXPECT_EQ(line.judge(11, 0ms, 310ms, true), Verdict::kNewLine);
  EXPECT_EQ(line.judge(11, 0ms, 410ms, true), Verdict::kRepeated);
  EXPECT_EQ(line.judge(12, 20ms, 420ms, true), Verdict::kNext);

  TimeLine real_time = ten_states();
  for (int i = 0; i < 5; ++i) EXPECT_EQ(real_time.judge(11, 0ms, 110ms, false), Verdict::kOff) << "sent twice or more";
}

TEST(TimeLine, SimulatedTimeMayPassFasterThanTheReceivers) {
  TimeLine line = ten_states();
  EXPECT_EQ(line.judge(11, 30s, 110ms, true), Verdict::kNext);
  EXPECT_EQ(line.judge(12, kHugeStamp, 120ms, true), Verdict::kOff);
  EXPECT_EQ(line.judge(13, 31s, 130ms, true), Verdict::kNext);
}

TEST(TimeLine, IsResumedWhereItWas) {
  TimeLine before = ten_states();
  TimeLine after;
  after.restore(before.state());
  EXPECT_EQ(after.judge(10, 100ms, 0ms, false), Verdict::kRepeated);
  EXPECT_EQ(after.judge(11, 110ms, 5ms, false), Verdict::kNext);
}

}  // namespace
}  // namespace gatefield::pilot
