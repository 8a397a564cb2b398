#include "client/sdk/asked_history.h"

#include <gtest/gtest.h>

#include <atomic>
#include <thread>

namespace gatefield::sdk {
namespace {

using protocol::Asked;
using protocol::AskedBy;
using namespace std::chrono_literals;

Asked other(double thrust_n) { return {AskedBy::kOther, {thrust_n, 0, 0, 0}}; }

TEST(AskedHistory, SaysWhatHeldAtAStamp) {
  AskedHistory history;
  EXPECT_EQ(history.at(1s).by, AskedBy::kPlans) << "nothing was asked for yet";
  history.note(10ms, {});
  history.note(20ms, {AskedBy::kFallback, {8, 1, 2, 3}});
  history.note(21ms, {AskedBy::kFallback, {9, 1, 2, 3}});
  history.note(30ms, {});
  EXPECT_EQ(history.at(5ms).by, AskedBy::kPlans);
  EXPECT_EQ(history.at(19ms).by, AskedBy::kPlans);
  EXPECT_EQ(history.at(20ms).command[0], 8);
  EXPECT_EQ(history.at(29ms).command[0], 9);
  EXPECT_EQ(history.at(29ms).by, AskedBy::kFallback);
  EXPECT_EQ(history.at(40ms).by, AskedBy::kPlans);
  EXPECT_EQ(history.at(40ms).by, AskedBy::kPlans) << "the same again";
}

TEST(AskedHistory, OfTwoForOneMomentTheLaterOneCounts) {
  AskedHistory history;
  history.note(10ms, {});
  history.note(10ms, other(5));
  EXPECT_EQ(history.at(10ms).command[0], 5);
}

TEST(AskedHistory, AClockThatBeginsAnewIsFollowed) {
  AskedHistory history;
  history.note(100s, other(5));
  history.note(1s, {});
  EXPECT_EQ(history.at(2s).by, AskedBy::kPlans);
  history.note(3s, other(6));
  EXPECT_EQ(history.at(4s).command[0], 6);
}

TEST(AskedHistory, AfterALongTimeWithoutStatesItGoesOn) {
  AskedHistory history;
  Stamp now = 1s;
  for (std::uint32_t i = 0; i < 3 * AskedHistory::kCapacity; ++i) history.note(now += 1ms, other(i));
  history.at(now);
  history.note(now += 1ms, {});
  EXPECT_EQ(history.at(now).by, AskedBy::kPlans);
  history.note(now += 1ms, other(7));
  EXPECT_EQ(history.at(now).command[0], 7);
}

TEST(AskedHistory, ThePlayingThreadNeitherWaitsNorTearsWhatTheOtherReads) {
  AskedHistory history;
  std::atomic<bool> done{false};
  std::thread sender([&] {
    for (Stamp stamp{0}; !done; ++stamp) {
      const Asked asked = history.at(1h);
      if (asked.told()) EXPECT_EQ(asked.command[0], asked.command[3]);
    }
  });
  for (int i = 1; i <= 100000; ++i) history.note(i * 1us, {AskedBy::kOther, RateCommand::Constant(i)});
  done = true;
  sender.join();
}

}  // namespace
}  // namespace gatefield::sdk
