#include "common/base/text.h"

#include <gtest/gtest.h>

#include <limits>

namespace gatefield {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

TEST(Text, SaysNumbersInTheirShortestForm) {
  EXPECT_EQ(text(0.5), "0.5");
  EXPECT_EQ(text(1e-5), "1e-05");
  EXPECT_EQ(text(123456789.25), "123456789");
  EXPECT_EQ(text(kNan), "nan");
  EXPECT_EQ(text(7), "7");
  EXPECT_EQ(text(Eigen::Vector3d(1, 2.5, -3)), "(1, 2.5, -3)");
  EXPECT_EQ(brief(1.0 / 3.0), "0.333333");
  EXPECT_EQ(brief(7.0), "7");
}

TEST(Text, KeepsAsManyDigitsAsAreAskedFor) {
  EXPECT_EQ(fixed(2.5, 2), "2.50");
  EXPECT_EQ(fixed(-0.00001, 4), "-0.0000");
  EXPECT_EQ(fixed(7.6, 0), "8");
}

TEST(Text, SaysTimesAsAClockDoes) {
  EXPECT_EQ(clock_text(75), "1:15");
  EXPECT_EQ(clock_text(3700), "1:01:40");
  EXPECT_EQ(clock_text(59.6), "1:00");
  EXPECT_EQ(clock_text(-3), "0:00");
  EXPECT_EQ(clock_text(kNan), "0:00");
  EXPECT_EQ(clock_text(1e300), clock_text(1e15)) << "what fits no integer";
}

TEST(Text, WritesBitsAsSixteenDigits) { EXPECT_EQ(hex(0xabcu), "0000000000000abc"); }

TEST(Shown, LeavesOutWhatDoesHarmAndWhatDoesNotFit) {
  EXPECT_EQ(shown("a\x1b[2J\nb\x7f", 100), "a?[2J?b?");
  EXPECT_EQ(shown("abcdef", 3), "abc");
  EXPECT_EQ(shown("", 3), "");
}

TEST(Printable, IsFalseForControlCharacters) {
  EXPECT_TRUE(printable("M\xc3\xbcller 1"));
  EXPECT_FALSE(printable("a\nb"));
  EXPECT_FALSE(printable("\x1b[2J"));
  EXPECT_FALSE(printable("\x7f"));
}

}  // namespace
}  // namespace gatefield
