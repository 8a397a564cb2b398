#include "server/service/phases.h"

#include <gtest/gtest.h>

namespace gatefield::service {
namespace {

using namespace std::chrono_literals;

TEST(FreePhase, WhoIsAloneIsDueOnePeriodLater) { EXPECT_EQ(free_phase({}, 20ms), 20ms); }

TEST(FreePhase, TheSecondComesHalfAPeriodAfterTheFirst) {
  EXPECT_EQ(free_phase({3ms}, 20ms), 13ms);
  EXPECT_EQ(free_phase({13ms}, 20ms), 3ms);
  EXPECT_EQ(free_phase({10ms}, 20ms), 20ms) << "not twice at one moment";
}

TEST(FreePhase, ANewcomerComesInTheLongestPause) {
  EXPECT_EQ(free_phase({13ms, 3ms}, 20ms), 18ms) << "of equal ones in that over the period's end";
  EXPECT_EQ(free_phase({3ms, 18ms, 13ms}, 20ms), 8ms);
  EXPECT_EQ(free_phase({5ms, 5ms, 6ms}, 20ms), 15500us) << "two at one moment are nobody's pause";
}

TEST(FreePhase, PeriodsNeedNotBeWhole) {
  const auto phase = free_phase({0ns, 7ns}, 20ns);
  EXPECT_EQ(phase, 13ns);
}

}  // namespace
}  // namespace gatefield::service
