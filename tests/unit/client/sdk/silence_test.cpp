#include "client/sdk/silence.h"

#include <gtest/gtest.h>

namespace gatefield::sdk {
namespace {

using namespace std::chrono_literals;

TEST(Silence, ACutLinkIsNoticedBeforeThePlanIsOver) {
  Silence silence;
  EXPECT_FALSE(silence.lasts(100s)) << "nothing was heard yet: the fallback flies in any case";
  for (Stamp now = 10s; now <= 11s; now += 20ms) silence.heard(now);
  EXPECT_FALSE(silence.lasts(11s + 120ms));
  EXPECT_TRUE(silence.lasts(11s + 121ms));
  silence.heard(11s + 200ms);
  EXPECT_FALSE(silence.lasts(11s + 201ms));
}

TEST(Silence, WhereCommandsComeInBunchesItTakesLonger) {
  Silence silence;
  Stamp now = 10s;
  for (int i = 0; i < 20; ++i) silence.heard(now += i % 4 == 0 ? 150ms : 1ms);
  EXPECT_FALSE(silence.lasts(now + 250ms));
  EXPECT_TRUE(silence.lasts(now + 301ms));
}

TEST(Silence, ALongPauseIsForgotten) {
  Silence silence;
  silence.heard(10s);
  silence.heard(11s + 500ms);
  EXPECT_FALSE(silence.lasts(13s));
  Stamp now = 11s + 500ms;
  for (int i = 0; i < 300; ++i) silence.heard(now += 20ms);
  EXPECT_TRUE(silence.lasts(now + 121ms)) << "six seconds later";
}

TEST(Silence, AClockThatGoesBackIsNoPause) {
  Silence silence;
  silence.heard(10s);
  silence.heard(5s);
  EXPECT_FALSE(silence.lasts(5s + 100ms));
}

}  // namespace
}  // namespace gatefield::sdk
