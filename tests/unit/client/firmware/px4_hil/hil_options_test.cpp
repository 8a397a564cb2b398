#include "client/firmware/px4_hil/hil_options.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace gatefield::firmware {
namespace {

using namespace std::chrono_literals;
using testing::AllOf;
using testing::HasSubstr;

HilOptions board() {
  HilOptions options;
  options.address = "serial:/dev/ttyACM0:921600";
  return options;
}

TEST(HilOptions, OfLockstepAreChecked) {
  EXPECT_TRUE(validate(HilOptions{}).ok());
  HilOptions options;
  options.address = "udp:127.0.0.1:4560";
  EXPECT_EQ(validate(options).failure().field, "address");
  options.address = "tcp-listen:127.0.0.1:x";
  EXPECT_EQ(validate(options).failure().field, "address.port");
  options = {};
  options.connect_timeout = 1ms;
  EXPECT_EQ(validate(options).failure().field, "connect_timeout");
  options = {};
  options.boot_timeout = 1ms;
  EXPECT_EQ(validate(options).failure().field, "boot_timeout");
  options = {};
  options.answer_timeout = 2min;
  EXPECT_EQ(validate(options).failure().field, "answer_timeout");
}

TEST(HilOptions, OfABoardAreChecked) {
  EXPECT_TRUE(validate(board()).ok());
  EXPECT_TRUE(is_board(board()));
  EXPECT_FALSE(is_board(HilOptions{}));
  HilOptions wrong = board();
  wrong.sample_rate_hz = 5;
  EXPECT_EQ(validate(wrong).failure().field, "sample_rate_hz");
  wrong = board();
  wrong.silence_limit = 10ms;
  EXPECT_EQ(validate(wrong).failure().field, "silence_limit");
  wrong = HilOptions{};
  wrong.sample_rate_hz = 200;
  EXPECT_THAT(validate(wrong).error(), HasSubstr("250 Hz in lockstep"));
}

TEST(HilOptions, SamplesOfABoardHaveToFitIntoTheBaudRate) {
  constexpr double kSetpoints_hz = 250.0;
  HilOptions serial = board();
  EXPECT_TRUE(check_room(serial, kSetpoints_hz).ok());
  serial.sample_rate_hz = 1000;
  const Status fast = check_room(serial, kSetpoints_hz);
  ASSERT_FALSE(fast.ok());
  EXPECT_EQ(fast.failure().field, "sample_rate_hz");
  // 921600 baud are 92160 bytes a second, of which 73728 are used. Samples are 77 bytes; 20 fixes of 51 and 250
  // setpoints of 63 a second, and 600 bytes of small things, leave 56358.
  EXPECT_THAT(fast.error(), HasSubstr("at most 731 Hz"));
  serial.sample_rate_hz = 731;
  EXPECT_TRUE(check_room(serial, kSetpoints_hz).ok());

  serial.address = "serial:/dev/ttyUSB0:57600";
  serial.sample_rate_hz = 250;
  const Status slow = check_room(serial, 0.0);
  ASSERT_FALSE(slow.ok());
  EXPECT_THAT(slow.error(), HasSubstr("at most 38 Hz, which fits into 57600 baud"));
  const Status slower = check_room(serial, kSetpoints_hz);
  ASSERT_FALSE(slower.ok());
  EXPECT_EQ(slower.failure().field, "address.baud");
  EXPECT_THAT(slower.error(), AllOf(HasSubstr("460800 or more"), HasSubstr("beside setpoints at 250 Hz")));
}

}  // namespace
}  // namespace gatefield::firmware
