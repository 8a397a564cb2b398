#include "common/protocol/identified_drive.h"

#include <gtest/gtest.h>

namespace gatefield::protocol {
namespace {

Actuation told() { return {Actuation::Kind::kBodyRates, 0.025, {0.04, 0.04, 0.08}}; }

TEST(IdentifiedDrive, SaysNothingWhileNothingIsKnown) { EXPECT_EQ(in_words(IdentifiedDrive{}, told()), ""); }

TEST(IdentifiedDrive, SaysWhatIsKnownBesideWhatWasTold) {
  EXPECT_EQ(in_words({1.084, {0, 0, 0}}, told()), "thrust 1.08 of what is asked for");
  EXPECT_EQ(in_words({0, {0.031, 0, 0.06}}, told()), "rates 31, ?, 60 ms behind (told: 40, 40, 80 ms)");
  EXPECT_EQ(in_words({0, {0, 0, 0}, {0, 2.93, 0}}, told()), "rates at most ?, 2.9, ? rad/s");
  EXPECT_EQ(
      in_words({1, {0.031, 0, 0}, {0, 2.93, 0}}, told()),
      "thrust 1.00 of what is asked for; rates 31, ?, ? ms behind (told: 40, 40, 80 ms), at most ?, 2.9, ? rad/s");
  EXPECT_EQ(in_words({0.9, {0.03, 0.03, 0.06}}, told()),
            "thrust 0.90 of what is asked for; rates 30, 30, 60 ms behind (told: 40, 40, 80 ms)");
}

}  // namespace
}  // namespace gatefield::protocol
