#include "client/bridge/mavlink/time_sync.h"

#include <gtest/gtest.h>

#include <functional>

#include "common/base/random.h"

namespace gatefield::bridge {
namespace {

using namespace std::chrono_literals;
using Trouble = TimeSync::Trouble;

/// Another machine whose clock is ahead by `offset` and runs faster by `drift`.
struct Other {
  Stamp offset{0};
  double drift = 0.0;
  Stamp at(Stamp ours) const { return ours + offset + from_seconds(drift * seconds(ours)); }
};

constexpr Stamp kBegin = 1000s;

/// Asks every 100 ms for `span`; `there` and `back` say how long each way takes.
template <typename Way>
Stamp talk(TimeSync* sync, const Other& other, Stamp begin, Stamp span, Way&& there, Way&& back) {
  Stamp now = begin;
  for (; now < begin + span; now += 100ms) {
    if (!sync->ask(now)) continue;
    const Stamp reached = now + there();
    sync->on_answer(reached + back(), now, other.at(reached));
  }
  return now;
}

std::function<Stamp()> always(Stamp span) {
  return [span] { return span; };
}

TEST(TimeSync, TranslatesStampsToWithinHalfOfARoundTrip) {
  TimeSync sync({});
  const Other other{-990s, 0.0};
  EXPECT_EQ(sync.trouble(kBegin), Trouble::kNoAnswers);
  const Stamp now = talk(&sync, other, kBegin, 2s, always(300us), always(1700us));
  ASSERT_EQ(sync.trouble(now), Trouble::kNone);
  EXPECT_EQ(sync.round_trip(), 2ms);
  const Stamp error = sync.ours(now, other.at(now)).value() - now;
  EXPECT_LE(std::max(error, -error), 1ms);
}

TEST(TimeSync, FindsDrift) {
  TimeSync sync({});
  const Other other{50s, 80e-6};
  const Stamp now = talk(&sync, other, kBegin, 10s, always(500us), always(500us));
  EXPECT_NEAR(sync.drift_ppm(), 80.0, 2.0);
  for (const Stamp later : {0ms, 500ms, 1000ms})
    EXPECT_LE(std::chrono::abs(sync.ours(now + later, other.at(now + later)).value() - now - later), 10us);
}

TEST(TimeSync, IsNotMisledByAnswersThatAQueueHeldUp) {
  Random random(3, Stream("test.time_sync"));
  TimeSync sync({});
  const Other other{5s, 20e-6};
  const std::function<Stamp()> there = [&] { return from_seconds(0.0005 + 0.0001 * random.uniform()); };
  const std::function<Stamp()> back = [&] {
    return from_seconds(0.0005 + (random.uniform() < 0.3 ? 0.02 * random.uniform() : 0.0));
  };
  const Stamp now = talk(&sync, other, kBegin, 20s, there, back);
  EXPECT_LE(std::chrono::abs(sync.ours(now, other.at(now)).value() - now), 300us);
  EXPECT_EQ(sync.restarts(), 0U);
}

TEST(TimeSync, BeginsAnewWhenTheOtherClockDoes) {
  TimeSync sync({});
  Stamp now = talk(&sync, Other{7000s, 0.0}, kBegin, 5s, always(1ms), always(1ms));
  const Other restarted{-now, 0.0};  // it has just booted
  now = talk(&sync, restarted, now, 2s, always(1ms), always(1ms));
  EXPECT_EQ(sync.restarts(), 1U);
  ASSERT_EQ(sync.trouble(now), Trouble::kNone);
  EXPECT_LE(std::chrono::abs(sync.ours(now, restarted.at(now)).value() - now), 1ms);
}

TEST(TimeSync, OneWildAnswerCostsItself) {
  TimeSync sync({});
  const Other other{10s, 0.0};
  Stamp now = talk(&sync, other, kBegin, 3s, always(1ms), always(1ms));
  for (const Stamp wild : {Stamp{0}, Stamp::max(), other.at(now) + 40ms}) {
    ASSERT_TRUE(sync.ask(now));
    sync.on_answer(now + 2ms, now, wild);
    now += 100ms;
    EXPECT_LE(std::chrono::abs(sync.ours(now, other.at(now)).value() - now), 1ms);
    now = talk(&sync, other, now, 200ms, always(1ms), always(1ms));
  }
  EXPECT_EQ(sync.restarts(), 0U);
}

TEST(TimeSync, CountsAnswersThatCanNotBe) {
  TimeSync sync({});
  sync.on_answer(kBegin, kBegin - 1ms, 5s);  // nobody asked
  ASSERT_TRUE(sync.ask(kBegin));
  sync.on_answer(kBegin + 1ms, kBegin + 500us, 5s);  // asked later than we did
  sync.on_answer(kBegin - 1ms, kBegin, 5s);          // heard before it was asked
  sync.on_answer(kBegin + 20s, kBegin, 5s);          // an age ago
  sync.on_answer(kBegin + 1ms, kBegin, Stamp{-1});   // before their clock began
  EXPECT_EQ(sync.impossible(), 5U);
  EXPECT_EQ(sync.answers(), 0U);
}

TEST(TimeSync, IsNotBelievedBeyondItsBounds) {
  TimeSyncOptions options;
  options.longest_round_trip = 10ms;
  options.most_drift_ppm = 100;
  TimeSync slow(options);
  Stamp now = talk(&slow, Other{}, kBegin, 3s, always(10ms), always(10ms));
  EXPECT_EQ(slow.trouble(now), Trouble::kRoundTrip);
  EXPECT_FALSE(slow.ours(now, now));

  TimeSync drifting(options);
  now = talk(&drifting, Other{0s, 300e-6}, kBegin, 5s, always(500us), always(500us));
  EXPECT_EQ(drifting.trouble(now), Trouble::kDrift);

  TimeSync silent(options);
  now = talk(&silent, Other{}, kBegin, 5s, always(500us), always(500us));
  EXPECT_EQ(silent.trouble(now), Trouble::kNone);
  EXPECT_EQ(silent.trouble(now + TimeSync::kSilent), Trouble::kNoAnswers);
}

TEST(TimeSync, AsksAsOftenAsToldTo) {
  TimeSync sync({});
  int asked = 0;
  for (Stamp now = kBegin; now < kBegin + 1s; now += 1ms) asked += sync.ask(now) ? 1 : 0;
  EXPECT_EQ(asked, 10);
}

TEST(TimeSync, TroubleIsSaidInWords) {
  const TimeSyncOptions options;
  EXPECT_TRUE(describe(Trouble::kNone, 1ms, 0, options).ok());
  EXPECT_EQ(describe(Trouble::kNoAnswers, 0ms, 0, options).failure().code, ErrorCode::kNoAnswer);
  EXPECT_EQ(describe(Trouble::kRoundTrip, 45ms, 0, options).failure().value, "45 ms");
  EXPECT_EQ(describe(Trouble::kDrift, 1ms, 700, options).failure().field, "time_sync.drift");
}

TEST(TimeSyncOptions, AreChecked) {
  EXPECT_TRUE(validate(TimeSyncOptions{}).ok());
  TimeSyncOptions options;
  options.ask_every = 1ms;
  EXPECT_EQ(validate(options).failure().field, "time_sync.ask_every");
  options = {};
  options.longest_round_trip = 2s;
  EXPECT_EQ(validate(options).failure().field, "time_sync.longest_round_trip");
  options = {};
  options.most_drift_ppm = 0;
  EXPECT_EQ(validate(options).failure().field, "time_sync.most_drift_ppm");
}

}  // namespace
}  // namespace gatefield::bridge
