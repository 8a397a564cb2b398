#include "client/flight/loop.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <mutex>
#include <thread>
#include <vector>

#include "tests/support/allocation_trap.h"

namespace gatefield::flight {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

constexpr Stamp kBegin = 100s;

/// Time goes on only by waiting; some waits take longer than asked for.
class FakeClock final : public LoopClock {
 public:
  Stamp now() const noexcept override { return now_; }
  Stamp sleep_until(Stamp deadline) noexcept override {
    now_ = std::max(now_, deadline);
    ++waits_;
    if (waits_ == late_wait_) now_ += lateness_;
    return now_;
  }
  /// The n-th wait (from 1) ends this much too late.
  void oversleep(int wait, Stamp lateness) {
    late_wait_ = wait;
    lateness_ = lateness;
  }

 private:
  Stamp now_ = kBegin;
  int waits_ = 0, late_wait_ = 0;
  Stamp lateness_{0};
};

/// Gives a plan every `plan_every` from `plans_from` on (of the fake clock), and writes down what it is given.
class FakeClient final : public sdk::Client {
 public:
  explicit FakeClient(const FakeClock& clock) : clock_(clock) {
    sent.reserve(100000);
    played.reserve(100000);
  }

  Stamp plans_from = kBegin;
  Stamp plans_until = Stamp::max();
  Stamp plan_every = 20ms;
  Stamp fallback_from = Stamp::max();

  struct Sent {
    Stamp at, stamp;
    QuadrotorState state;
    bool thrust_known;
  };
  std::vector<Sent> sent;
  std::vector<Stamp> played;
  std::vector<Stamp> frames() const {
    const std::lock_guard lock(mutex_);
    return frames_;
  }

  protocol::SessionReply session() const override {
    protocol::SessionReply reply;
    reply.control_period_s = 0.02;
    return reply;
  }
  std::uint64_t send_depth(Stamp stamp, std::span<const float>) override { return take_frame(stamp); }
  std::uint64_t send_depth_counts(Stamp stamp, std::span<const std::uint16_t>) override { return take_frame(stamp); }
  std::uint64_t send_state(Stamp stamp, const QuadrotorState& state, bool thrust_known) override {
    sent.push_back({clock_.now(), stamp, state, thrust_known});
    return sent.size();
  }
  std::optional<protocol::ThrustRateCommand> newest() override {
    if (clock_.now() < next_plan_ || clock_.now() < plans_from || clock_.now() >= plans_until) return std::nullopt;
    next_plan_ = clock_.now() + plan_every;
    protocol::ThrustRateCommand command{};
    command.sequence = ++sequence_;
    return command;
  }
  std::optional<protocol::ThrustRateCommand> wait_for_answer(std::uint64_t, std::chrono::milliseconds) override {
    ADD_FAILURE() << "a real-time loop waits for no answer";
    return std::nullopt;
  }
  sdk::Setpoint play(Stamp now, const QuadrotorState&, std::chrono::nanoseconds) override {
    played.push_back(now);
    sdk::Setpoint setpoint;
    setpoint.source = now < fallback_from ? sdk::Setpoint::Source::kPlan : sdk::Setpoint::Source::kFallback;
    setpoint.rotor_thrust_n.setConstant(static_cast<double>(played.size()));
    return setpoint;
  }
  void applied(Stamp, const std::optional<sdk::Setpoint>&) override {
    ADD_FAILURE() << "who plays has nothing to tell";
  }
  sdk::LinkStatistics statistics() const override { return {}; }
  protocol::Problems problems() const override { return 0; }
  std::optional<sdk::ProblemChange> problem_change() override { return std::nullopt; }
  std::optional<sdk::SessionChange> session_change() override { return std::nullopt; }
  std::optional<protocol::Telemetry> telemetry() override { return std::nullopt; }

 private:
  std::uint64_t take_frame(Stamp stamp) {
    const std::lock_guard lock(mutex_);
    frames_.push_back(stamp);
    return frames_.size();
  }

  const FakeClock& clock_;
  Stamp next_plan_{0};
  std::uint64_t sequence_ = 0;
  mutable std::mutex mutex_;
  std::vector<Stamp> frames_;
};

/// A vehicle that is over after so many steps.
class FakeVehicle final : public StateSource, public Actuator, public Observer {
 public:
  int steps_left = 1000;
  Stamp own_period = 1ms;
  SetpointPart part = SetpointPart::kRotorThrustRates;
  Stamp state_every{1};          ///< its states have stamps that are multiples of this
  Stamp first_state = Stamp{0};  ///< nothing is known before
  std::vector<Stamp> applied, held;
  int plans = 0;

  FakeVehicle() {
    applied.reserve(100000);
    held.reserve(100000);
  }

  std::optional<TimedState> newest(Stamp now) noexcept override {
    if (now < first_state) return std::nullopt;
    TimedState state;
    state.stamp = now / state_every * state_every;
    state.state.thrust_command_n.setConstant(-1.0);
    state.thrust_known = false;
    return state;
  }
  SetpointPart accepts() const noexcept override { return part; }
  Stamp period() const noexcept override { return own_period; }
  void apply(Stamp now, const sdk::Setpoint&) noexcept override { applied.push_back(now); }
  void hold(Stamp now) noexcept override { held.push_back(now); }
  void on_plan(const protocol::ThrustRateCommand&) noexcept override { ++plans; }
  bool goes_on() noexcept override { return --steps_left > 0; }
};

class FlightLoop : public testing::Test {
 protected:
  LoopStatistics run() { return run_loop({&vehicle, nullptr, &vehicle, &vehicle}, &client, options, &clock, stop); }

  FakeClock clock;
  FakeClient client{clock};
  FakeVehicle vehicle;
  LoopOptions options;
  std::atomic<bool> stop{false};
};

TEST_F(FlightLoop, AppliesASetpointEveryPeriodAtTheTimeItIsDueAt) {
  vehicle.steps_left = 100;
  vehicle.own_period = 4ms;
  const LoopStatistics flown = run();
  EXPECT_EQ(flown.end, End::kOver);
  EXPECT_EQ(flown.steps, 100u);
  EXPECT_EQ(flown.late_steps, 0u);
  ASSERT_EQ(vehicle.applied.size(), 100u);
  EXPECT_EQ(client.played, vehicle.applied);
  for (std::size_t i = 0; i < vehicle.applied.size(); ++i) ASSERT_EQ(vehicle.applied[i], kBegin + i * 4ms);
  EXPECT_EQ(flown.flown, 400ms);
}

TEST_F(FlightLoop, SendsStatesAtTheirRateWithTheirOwnStamps) {
  options.state_rate_hz = 100;
  const LoopStatistics flown = run();
  EXPECT_EQ(flown.states_sent, 100u);
  ASSERT_EQ(client.sent.size(), 100u);
  for (std::size_t i = 0; i < client.sent.size(); ++i) ASSERT_EQ(client.sent[i].stamp, kBegin + i * 10ms);
  EXPECT_FALSE(client.sent[0].thrust_known);
}

TEST_F(FlightLoop, ASourceSlowerThanTheRateIsSentOncePerState) {
  vehicle.state_every = 25ms;
  run();
  ASSERT_EQ(client.sent.size(), 40u);
  for (std::size_t i = 0; i < client.sent.size(); ++i) {
    EXPECT_EQ(client.sent[i].stamp, kBegin + i * 25ms);
    EXPECT_EQ(client.sent[i].at, client.sent[i].stamp) << "at once";
  }
}

TEST_F(FlightLoop, HoldsTheVehicleUntilTheFirstPlanAndCountsFromThere) {
  client.plans_from = kBegin + 300ms;
  const LoopStatistics flown = run();
  EXPECT_EQ(vehicle.held.size(), 300u);
  EXPECT_EQ(vehicle.applied.size(), 700u);
  EXPECT_EQ(vehicle.applied.front(), kBegin + 300ms);
  EXPECT_EQ(flown.flown, 700ms);
  EXPECT_EQ(client.sent.size(), 200u) << "states are sent from the beginning";
  EXPECT_EQ(flown.control_periods, 35u);
  EXPECT_EQ(flown.periods_without_plan, 0u) << "what was before the first plan does not count";
}

TEST_F(FlightLoop, HoldsTheVehicleAsLongAsNothingIsKnownOfIt) {
  vehicle.first_state = kBegin + 100ms;
  const LoopStatistics flown = run();
  EXPECT_EQ(vehicle.held.size(), 100u);
  EXPECT_EQ(client.sent.front().stamp, kBegin + 100ms);
  EXPECT_EQ(flown.flown, 900ms);
}

TEST_F(FlightLoop, PlansThatStopComingAreCountedAndTheFallbackTimed) {
  client.plans_until = kBegin + 500ms;
  client.fallback_from = kBegin + 900ms;
  const LoopStatistics flown = run();
  EXPECT_EQ(vehicle.plans, 25);
  EXPECT_NEAR(static_cast<double>(flown.periods_without_plan), 25.0, 1.0);
  EXPECT_EQ(flown.on_fallback, 100ms);
  EXPECT_EQ(flown.flown, 1000ms);
}

TEST_F(FlightLoop, GivesUpWithoutPlansAndNotBefore) {
  vehicle.steps_left = 100000;
  options.give_up = 700ms;
  client.plans_until = kBegin + 1000ms;
  const LoopStatistics flown = run();
  EXPECT_EQ(flown.end, End::kGivenUp);
  EXPECT_NEAR(seconds(clock.now() - kBegin), 0.980 + 0.7, 0.005);

  FakeClient silent(clock);
  silent.plans_from = Stamp::max();
  const Stamp begin = clock.now();
  const auto never = run_loop({&vehicle, nullptr, &vehicle, &vehicle}, &silent, options, &clock, stop);
  EXPECT_EQ(never.end, End::kGivenUp);
  EXPECT_EQ(never.flown, Stamp{0});
  EXPECT_NEAR(seconds(clock.now() - begin), 0.7, 0.005);
}

TEST_F(FlightLoop, TheStopFlagEndsItWithinAStep) {
  stop = true;
  const LoopStatistics flown = run();
  EXPECT_EQ(flown.end, End::kStopped);
  EXPECT_EQ(flown.steps, 1u);
}

TEST_F(FlightLoop, NobodyNeedsToWatch) {
  options.give_up = 50ms;
  client.plans_until = kBegin + 100ms;
  const auto flown = run_loop({&vehicle, nullptr, &vehicle, nullptr}, &client, options, &clock, stop);
  EXPECT_EQ(flown.end, End::kGivenUp);
  EXPECT_EQ(vehicle.plans, 0);
}

TEST_F(FlightLoop, ALateStepIsCountedAndTheFollowingOnesCatchUp) {
  clock.oversleep(101, 30ms);
  const LoopStatistics flown = run();
  EXPECT_EQ(flown.steps, 1000u);
  EXPECT_EQ(flown.late_steps, 29u) << "of 30, 29, ..., 1 ms the last is within the tolerance";
  EXPECT_EQ(flown.worst_late, 30ms);
  EXPECT_EQ(flown.slipped, Stamp{0});
  for (std::size_t i = 0; i < vehicle.applied.size(); ++i) ASSERT_EQ(vehicle.applied[i], kBegin + i * 1ms);
  EXPECT_EQ(clock.now(), kBegin + 999ms);
}

TEST_F(FlightLoop, FartherBehindTheTimeIsGivenUp) {
  clock.oversleep(101, 400ms);
  const LoopStatistics flown = run();
  EXPECT_EQ(flown.late_steps, 1u);
  EXPECT_EQ(flown.slipped, 400ms);
  EXPECT_EQ(vehicle.applied[100], kBegin + 100ms) << "the late step itself was due then";
  EXPECT_EQ(vehicle.applied[101], kBegin + 501ms);
  EXPECT_EQ(clock.now(), kBegin + 1399ms);
}

TEST_F(FlightLoop, AVehicleWhoseTimeGoesOnByItselfSkipsWhatItMissed) {
  options.slip_after = vehicle.own_period;
  clock.oversleep(101, 5ms);
  const LoopStatistics flown = run();
  EXPECT_EQ(flown.late_steps, 1u);
  EXPECT_EQ(vehicle.applied[101], kBegin + 106ms);
}

TEST_F(FlightLoop, WhatTheRotorsWereAskedForGoesBackUnlessTheVehicleKnowsIt) {
  vehicle.steps_left = 50;
  run();
  for (const auto& sent : client.sent) EXPECT_EQ(sent.state.thrust_command_n[0], -1.0) << "it integrates the rates";

  FakeClient thrusts(clock);
  thrusts.plans_from = clock.now();
  vehicle.part = SetpointPart::kRotorThrusts;
  vehicle.steps_left = 50;
  run_loop({&vehicle, nullptr, &vehicle, &vehicle}, &thrusts, options, &clock, stop);
  ASSERT_GE(thrusts.sent.size(), 3u);
  EXPECT_EQ(thrusts.sent[0].state.thrust_command_n[0], -1.0) << "nothing was applied yet";
  EXPECT_EQ(thrusts.sent[2].state.thrust_command_n[0], 10.0) << "of the setpoint before, the tenth";

  FakeClient rates(clock);
  rates.plans_from = clock.now();
  vehicle.part = SetpointPart::kCollectiveAndBodyRates;
  vehicle.steps_left = 50;
  run_loop({&vehicle, nullptr, &vehicle, &vehicle}, &rates, options, &clock, stop);
  for (const auto& sent : rates.sent) EXPECT_EQ(sent.state.thrust_command_n[0], -1.0) << "its rotors are not asked";
}

TEST_F(FlightLoop, StepsAllocateNothing) {
  class Counting final : public Observer {
   public:
    int steps = 0;
    std::size_t at_first = 0, at_last = 0;
    test::AllocationTrap trap;
    void on_plan(const protocol::ThrustRateCommand&) noexcept override {}
    bool goes_on() noexcept override {
      at_last = trap.count();
      if (++steps == 1) at_first = at_last;
      return steps < 500;
    }
  } counting;
  run_loop({&vehicle, nullptr, &vehicle, &counting}, &client, options, &clock, stop);
  EXPECT_EQ(counting.steps, 500);
  EXPECT_EQ(counting.at_last, counting.at_first);
}

/// Frames of a camera that takes its time; some are in metres.
class FakeCamera final : public DepthSource {
 public:
  std::optional<DepthFrame> next(std::chrono::nanoseconds timeout) override {
    std::this_thread::sleep_for(std::min<std::chrono::nanoseconds>(timeout, 1ms));
    caller = std::this_thread::get_id();
    if (++count % 3 == 0) return std::nullopt;
    if (count % 3 == 1) return DepthFrame{Stamp{count}, std::span<const std::uint16_t>(counts)};
    return DepthFrame{Stamp{count}, std::span<const float>(metres)};
  }
  int count = 0;
  std::thread::id caller;
  std::vector<std::uint16_t> counts = std::vector<std::uint16_t>(16, 1000);
  std::vector<float> metres = std::vector<float>(16, 1.0f);
};

TEST_F(FlightLoop, FramesAreSentByAThreadOfTheirOwnWithTheStampsOfTheirCapture) {
  FakeCamera camera;
  RealTimeClock real;
  client.plan_every = 1h;  // one plan; the fake clock stands still
  vehicle.steps_left = 100;
  const auto flown = run_loop({&vehicle, &camera, &vehicle, &vehicle}, &client, options, &real, stop);
  EXPECT_GT(flown.frames_sent, 2u);
  const auto frames = client.frames();
  EXPECT_EQ(frames.size(), flown.frames_sent);
  EXPECT_NE(camera.caller, std::this_thread::get_id());
  for (const Stamp frame : frames) EXPECT_NE(frame.count() % 3, 0);
  EXPECT_TRUE(std::is_sorted(frames.begin(), frames.end()));
}

TEST(FlightClock, TheMachinesOneWakesAtTheDeadlineOrLater) {
  RealTimeClock clock;
  const Stamp deadline = clock.now() + 5ms;
  EXPECT_GE(clock.sleep_until(deadline), deadline);
  const Stamp past = clock.now() - 1s;
  EXPECT_GE(clock.sleep_until(past), past + 1s) << "what has passed is not waited for";
}

TEST(FlightOptions, NonsenseIsRefusedByField) {
  EXPECT_TRUE(validate(LoopOptions{}).ok());
  LoopOptions options;
  options.state_rate_hz = 5;
  EXPECT_THAT(validate(options).error(), HasSubstr("state_rate_hz is 5 Hz, expected 10 to 1000 Hz"));
  options = {};
  options.slip_after = -1ms;
  EXPECT_EQ(validate(options).failure().field, "slip_after");
  options = {};
  options.give_up = 0ms;
  EXPECT_EQ(validate(options).failure().field, "give_up");
}

}  // namespace
}  // namespace gatefield::flight
