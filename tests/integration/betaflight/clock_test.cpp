#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <thread>

#include "client/firmware/betaflight_sitl/exchange.h"
#include "common/base/child_process.h"

namespace gatefield::firmware::betaflight_sitl {
namespace {

using namespace std::chrono_literals;

/// A program with the clock library in it, and the simulator's side of it. Ports are those of the firmware.
class ClockLibrary : public testing::Test {
 protected:
  void SetUp() override {
    ChildOptions child;
    child.arguments = {GATEFIELD_CLOCKED_PROGRAM};
    child.environment = {{"LD_PRELOAD", GATEFIELD_CLOCK_LIBRARY}};
    auto started = ChildProcess::start(child);
    ASSERT_TRUE(started.ok()) << started.error();
    program = std::move(started).value();
    std::this_thread::sleep_for(300ms);  // until it listens
    auto opened = Exchange::open({}, clock);
    ASSERT_TRUE(opened.ok()) << opened.error();
    exchange = std::move(opened).value();
  }

  struct Known {
    double time_s = -1.0, channel_us = -1.0;
  };
  Known step(std::chrono::nanoseconds span = 1ms) {
    exchange->begin_step({}, span);
    const auto motors = exchange->end_step(20s);
    EXPECT_TRUE(motors.has_value());
    // until 2025 the packet's first two numbers are those of the front right and the rear left motor
    return motors ? Known{100 * (*motors)[1], 2000 * (*motors)[2]} : Known{};
  }

  MonotonicClock clock;
  std::unique_ptr<ChildProcess> program;
  std::unique_ptr<Exchange> exchange;
};

constexpr double kLoop_s = 70e-6;  // of the program, and looks at its clock

TEST_F(ClockLibrary, ATimeOfItsOwnPassesWithEachStateHoweverLongItTakes) {
  double last_s = step().time_s;
  last_s = step().time_s;
  for (int i = 0; i < 200; ++i) {
    if (i % 50 == 0) std::this_thread::sleep_for(100ms);
    const std::chrono::nanoseconds span = i % 2 == 0 ? 1ms : 3ms;
    const double now_s = step(span).time_s;
    // It tells the time at which it saw the state: within a turn of its loop after the step began.
    EXPECT_NEAR(now_s - last_s, seconds(i == 0 ? 1ms : i % 2 == 0 ? 3ms : 1ms), kLoop_s) << "step " << i;
    last_s = now_s;
  }
}

TEST_F(ClockLibrary, ChannelsThatWentBeforeAStateAreKnownInItsStep) {
  (void)step();
  for (std::uint16_t pulse = 1000; pulse < 1100; ++pulse) {
    Channels channels{};
    channels[0] = pulse;
    ASSERT_TRUE(exchange->send(channels));
    EXPECT_NEAR(step().channel_us, pulse, 0.01);
  }
}

TEST_F(ClockLibrary, AnEndedSimulatorLeavesItWithTheMachinesClock) {
  const double before_s = step().time_s;
  exchange.reset();
  const Stamp freed = clock.now();
  std::this_thread::sleep_for(1s);
  auto again = Exchange::open({}, clock);
  ASSERT_TRUE(again.ok()) << again.error();
  exchange = std::move(again).value();
  const double after_s = step().time_s;
  EXPECT_GT(after_s - before_s, 0.9);
  EXPECT_LT(after_s - before_s, seconds(clock.now() - freed) + 0.1);
}

}  // namespace
}  // namespace gatefield::firmware::betaflight_sitl
