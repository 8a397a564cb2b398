// The same events give the same commands, bit for bit.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/server/pilot/flight.h"

namespace gatefield::pilot {
namespace {

class Replay : public ::testing::TestWithParam<protocol::Timing> {};

TEST_P(Replay, GivesTheSameCommandsBitForBit) {
  testing::Flight flight(GetParam());
  const auto first = flight.make_pilot();
  const std::vector<std::string> flown = flight.fly(first.get(), 160);
  ASSERT_GT(flown.size(), 150u);
  EXPECT_GE(flight.target_waypoint() + 4 * flight.lap(), 2u);  // it flew through gates that it saw
  EXPECT_TRUE(first->looking().sight().records().seen(0));

  const auto second = flight.make_pilot();
  std::vector<std::string> again;
  Stepping::Answer answer;
  for (const Event& event : flight.events()) {
    if (std::holds_alternative<Ticked>(event))
      answer = second->feed(event);
    else
      second->feed(event);
    // What was measured belongs to the command.
    if (std::holds_alternative<Solved>(event)) again.push_back(testing::text_of(*answer.command));
  }
  EXPECT_EQ(again, flown);
}

TEST_P(Replay, WhatWasMeasuredDecidesInRealTimeAlone) {
  testing::Flight flight(GetParam());
  const auto first = flight.make_pilot();
  flight.fly(first.get(), 40);
  const auto plan_starts = [&](std::chrono::nanoseconds more) {
    const auto pilot = flight.make_pilot();
    std::vector<Stamp> starts;
    for (Event event : flight.events()) {
      if (auto* const solved = std::get_if<Solved>(&event)) solved->took += more;
      if (const auto answer = pilot->feed(event); answer.command) starts.push_back(answer.command->plan_start);
    }
    return starts;
  };
  EXPECT_EQ(plan_starts(Stamp{0}) == plan_starts(std::chrono::milliseconds(2)),
            GetParam() == protocol::Timing::kLockstep);
}

INSTANTIATE_TEST_SUITE_P(Timings, Replay, ::testing::Values(protocol::Timing::kLockstep, protocol::Timing::kRealTime),
                         [](const auto& timing) {
                           return timing.param == protocol::Timing::kLockstep ? "Lockstep" : "RealTime";
                         });

}  // namespace
}  // namespace gatefield::pilot
