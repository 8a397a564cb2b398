#include "client/simulator/simulated_link.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <utility>
#include <vector>

#include "client/simulator/plant.h"

namespace gatefield::simulator {
namespace {

using namespace std::chrono_literals;

QuadrotorState at(double x_m) {
  QuadrotorState state;
  state.p_WB.x() = x_m;
  return state;
}

TEST(SimulatedLink, WithoutDelayWhatIsSentIsThereAtOnce) {
  SimulatedLink link({}, 1);
  link.begin(at(0));
  link.remember(at(5));
  link.send_state(10s);
  link.send_frame(10s, 9s, {}, {7, 8});
  const auto state = link.take_state(10s);
  ASSERT_TRUE(state);
  EXPECT_EQ(state->stamp, 10s);
  EXPECT_EQ(state->state.p_WB.x(), 5.0);
  EXPECT_FALSE(link.take_state(10s)) << "once";
  const auto frame = link.take_frame(10s);
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->counts, (std::vector<std::uint16_t>{7, 8}));
  EXPECT_EQ(frame->stamp, 9s) << "as it was given";
  EXPECT_FALSE(link.take_frame(10s));
}

TEST(SimulatedLink, ADelayShowsStatesOfThePastAndFramesLater) {
  SimulatedLink link({.delay = 3ms}, 1);
  link.begin(at(-1));
  for (int ms = 0; ms < 10; ++ms) {
    const Stamp now = 10s + ms * 1ms;
    link.remember(at(ms));
    link.send_state(now);
    const auto state = link.take_state(now);
    ASSERT_TRUE(state);
    EXPECT_EQ(state->stamp, now - 3ms);
    EXPECT_EQ(state->state.p_WB.x(), ms < 3 ? -1.0 : ms - 3.0);
  }
  link.send_frame(20s, 20s, {}, {});
  EXPECT_FALSE(link.take_frame(20s + 2ms));
  const auto frame = link.take_frame(20s + 3ms);
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->stamp, 20s) << "of its capture";
}

TEST(SimulatedLink, WhatANewerOneHasOvertakenIsLost) {
  SimulatedLink link({.jitter = 40ms}, 3);
  link.begin(at(0));
  Stamp last_state{0}, last_frame{0};
  int states = 0, frames = 0;
  for (int ms = 0; ms < 2000; ++ms) {
    const Stamp now = 10s + ms * 1ms;
    link.remember(at(ms));
    if (ms % 10 == 0) {
      link.send_state(now);
      link.send_frame(now, now, {}, {});
    }
    if (const auto state = link.take_state(now)) {
      EXPECT_GT(state->stamp, last_state);
      last_state = state->stamp;
      ++states;
    }
    while (const auto frame = link.take_frame(now)) {
      EXPECT_GT(frame->stamp, last_frame);
      last_frame = frame->stamp;
      ++frames;
    }
  }
  EXPECT_GT(states, 50);
  EXPECT_LT(states, 190);
  EXPECT_GT(frames, 50);
  EXPECT_LT(frames, 190);
}

TEST(SimulatedLink, LossTakesAStateOnBothWaysAndAFrameOnOne) {
  SimulatedLink link({.loss = 0.3}, 5);
  link.begin(at(0));
  int states = 0, frames = 0;
  constexpr int kSent = 5000;
  for (int i = 0; i < kSent; ++i) {
    link.send_state(10s);
    link.send_frame(10s, 10s, {}, {});
    states += link.take_state(10s).has_value();
    frames += link.take_frame(10s).has_value();
  }
  EXPECT_NEAR(states, 0.49 * kSent, 0.03 * kSent);
  EXPECT_NEAR(frames, 0.7 * kSent, 0.03 * kSent);
}

TEST(SimulatedLink, NothingGetsThroughDuringAnOutage) {
  SimulatedLink link({.delay = 20ms, .outage_begin = 10s + 100ms, .outage = 300ms}, 5);
  link.begin(at(0));
  std::vector<Stamp> states, frames;
  for (Stamp now = 10s; now < 11s; now += 10ms) {
    link.send_state(now);
    link.send_frame(now, now, {}, {});
    if (const auto state = link.take_state(now)) states.push_back(state->stamp);
    while (const auto frame = link.take_frame(now)) frames.push_back(frame->stamp);
  }
  const auto silent = [](const std::vector<Stamp>& stamps) {
    const auto gap = std::adjacent_find(stamps.begin(), stamps.end(), [](Stamp a, Stamp b) { return b - a > 10ms; });
    return gap == stamps.end() ? std::pair(Stamp{0}, Stamp{0}) : std::pair(*gap, *(gap + 1));
  };
  EXPECT_EQ(silent(states), std::pair(Stamp(10s + 70ms), Stamp(10s + 400ms))) << "what was on its way is lost, too";
  EXPECT_EQ(silent(frames), std::pair(Stamp(10s + 70ms), Stamp(10s + 400ms)));
}

TEST(SimulatedLink, OutagesBeginWhereTheSeedSays) {
  EXPECT_EQ(SimulatedLink::outage_begin(7), SimulatedLink::outage_begin(7));
  std::set<Stamp> begins;
  for (std::uint64_t seed = 1; seed <= 50; ++seed) {
    const Stamp begin = SimulatedLink::outage_begin(seed);
    EXPECT_GE(begin, SimulatedLink::kFirstOutage);
    EXPECT_LE(begin, SimulatedLink::kLastOutage);
    begins.insert(begin);
  }
  EXPECT_GT(begins.size(), 45u);
}

}  // namespace
}  // namespace gatefield::simulator
