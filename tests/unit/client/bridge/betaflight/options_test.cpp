#include "client/bridge/betaflight/options.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>

namespace gatefield::bridge::betaflight {
namespace {

TEST(BetaflightOptions, AsTheyComeTheyAreFine) { EXPECT_TRUE(validate(Options{}).ok()); }

TEST(BetaflightOptions, EveryFieldOutOfItsRangeIsTold) {
  struct Case {
    const char* field;
    std::function<void(Options*)> spoil;
  };
  for (const auto& [field, spoil] : {
           Case{"channels_hz", [](Options* o) { o->channels_hz = 49; }},
           Case{"channels_hz", [](Options* o) { o->channels_hz = 501; }},
           Case{"channels_hz", [](Options* o) { o->channels_hz = std::nan(""); }},
           Case{"arm_aux", [](Options* o) { o->arm_aux = 0; }},
           Case{"arm_aux", [](Options* o) { o->arm_aux = 15; }},
           Case{"arm_us", [](Options* o) { o->arm_us = 999; }},
           Case{"arm_us", [](Options* o) { o->arm_us = 2001; }},
           Case{"kill", [](Options* o) { o->kill.emplace(); }},
           Case{"kill.aux",
                [](Options* o) {
                  o->receiver = Options::Receiver::kOverride;
                  o->kill = Switch{15, 1700, 2100};
                }},
           Case{"kill.from_us",
                [](Options* o) {
                  o->receiver = Options::Receiver::kOverride;
                  o->kill = Switch{2, 2000, 1700};
                }},
           Case{"thrust.hover_throttle", [](Options* o) { o->thrust.hover_throttle = 2; }},
       }) {
    Options options;
    spoil(&options);
    const Status status = validate(options);
    ASSERT_FALSE(status.ok()) << field;
    EXPECT_EQ(status.failure().field, field);
    EXPECT_THAT(status.error(), testing::HasSubstr("expected")) << field;
  }
}

}  // namespace
}  // namespace gatefield::bridge::betaflight
