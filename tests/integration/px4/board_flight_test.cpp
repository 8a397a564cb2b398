// gatefield-sim with a board of our own on a pseudo terminal, and a server: through one gate, in real time.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/integration/race/programs.h"
#include "tests/support/serial_board.h"

namespace gatefield::test {
namespace {

using namespace std::chrono_literals;
using ::testing::AnyOf;
using ::testing::HasSubstr;

/// racer-rates' rotors turn against those of the board's usual mixer; a machine that is busy may leave it waiting.
SerialBoard::Options board_of_the_racer() {
  SerialBoard::Options options;
  options.loop.yaw_gain = -options.loop.yaw_gain;
  options.loop.failsafe_after = 3s;
  options.thrust_linear = true;
  return options;
}

class BoardFlight : public ::testing::Test {
 protected:
  Process simulator(const std::string& log, const std::vector<std::string>& extra) const {
    std::vector<std::string> arguments{"--flight-controller", "px4"};
    arguments.insert(arguments.end(), extra.begin(), extra.end());
    return programs_.simulator(log, arguments);
  }
  /// What it says, and that it ends as one of bad input.
  std::string refusal(const std::vector<std::string>& extra) const {
    Process sim = simulator("refused.log", extra);
    EXPECT_EQ(sim.wait(20s).value_or(-1), 2) << sim.output();
    return sim.output();
  }

  Programs programs_{"board-flight"};
};

/// A board waits for nobody, so on a busy machine a race may end at a gate's frame; then it is flown again. Whatever
/// becomes of it, the board is armed and flies, and the end is told.
TEST_F(BoardFlight, OneGateIsFlownByTheBoardsMotors) {
  constexpr int kAttempts = 3;
  Process server = programs_.server("server.log");
  for (int attempt = 1; attempt <= kAttempts; ++attempt) {
    SerialBoard board(board_of_the_racer());
    Process sim = simulator("sim" + std::to_string(attempt) + ".log",
                            {"--firmware-address", board.address(), "--realtime", "--course", "one-gate", "--vehicle",
                             "racer-rates", "--speed", "2", "--time-limit", "20"});
    const auto code = sim.wait(90s);
    const std::string output = sim.output();
    ASSERT_THAT(code.value_or(-1), AnyOf(0, 1)) << output;
    EXPECT_THAT(output, HasSubstr("Firmware      PX4, system 1, component 1, on " + board.address()));
    EXPECT_GT(board.samples(), 500u);
    EXPECT_EQ(board.truths(), 0u);
    EXPECT_FALSE(board.armed()) << "its motors were stopped after the race";
    if (code == 0) return;
  }
  ADD_FAILURE() << "the gate was missed " << kAttempts << " times";
}

TEST_F(BoardFlight, WhatMakesNoSenseIsRefusedBeforeAnythingIsOpened) {
  EXPECT_THAT(refusal({"--firmware-address", "serial:/dev/ttyACM0:921600"}),
              HasSubstr("a board on a serial port runs by its own clock, expected real time (--realtime)"));
  EXPECT_THAT(refusal({"--realtime"}), HasSubstr("expected lockstep"));
  EXPECT_THAT(refusal({"--firmware-address", "serial:/dev/ttyACM0:57600", "--realtime"}),
              HasSubstr("460800 or more: no useful rate of samples fits beside setpoints"));
  EXPECT_THAT(refusal({"--firmware-address", "serial:/dev/ttyACM0:57600", "--realtime", "--firmware-setpoints", "bus"}),
              HasSubstr("at most 38 Hz, which fits into 57600 baud"));
  EXPECT_THAT(refusal({"--firmware-setpoints", "same"}), HasSubstr("PX4's SITL takes none there"));
}

}  // namespace
}  // namespace gatefield::test
