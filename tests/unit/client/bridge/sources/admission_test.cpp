#include "client/bridge/sources/admission.h"

#include <gmock/gmock.h>

namespace gatefield::bridge::sources {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

constexpr std::chrono::nanoseconds kWall = 1'700'000'000s;  // when the loop's clock says 100 s

Moment at(Stamp since) { return {100s + since, kWall + since}; }

TEST(Admission, TranslatesTheStampByTheSystemsClock) {
  Admission admission({});
  EXPECT_EQ(admission.admit(at(0ms), kWall - 7ms, 1), Stamp(100s - 7ms));
  EXPECT_EQ(admission.age(), 7ms);
  EXPECT_FALSE(admission.complaint("/pose"));
}

TEST(Admission, OfClocksThatAreNotOursTheArrivalCounts) {
  Admission admission({.from = TimeOptions::From::kArrival, .delay = 4ms});
  EXPECT_EQ(admission.admit(at(0ms), 17s, 1), Stamp(100s - 4ms));
  EXPECT_EQ(admission.admit(at(5ms), 16s, 1), Stamp(100s + 1ms)) << "whatever the message says";
}

TEST(Admission, ClocksThatDoNotAgreeAreToldWithHowFarTheyAreOff) {
  Admission admission({});
  EXPECT_FALSE(admission.admit(at(0ms), kWall + 11ms, 1));
  EXPECT_EQ(admission.refused(Refusal::kFuture), 1U);
  EXPECT_THAT(admission.complaint("/pose")->message,
              HasSubstr("/pose: 1 messages were refused; header.stamp is -11.0"));
  EXPECT_FALSE(admission.admit(at(1ms), kWall - 240ms, 1));
  EXPECT_FALSE(admission.admit(at(2ms), kWall - 240ms, 1));
  EXPECT_THAT(admission.complaint("/pose")->message, HasSubstr("is 242.0 ms old, expected -10.0 ms to 100.0 ms"));
  EXPECT_EQ(admission.taken(), 0U);
}

TEST(Admission, StampsThatDoNotRiseAreRefused) {
  Admission admission({});
  EXPECT_TRUE(admission.admit(at(0ms), kWall, 1));
  EXPECT_FALSE(admission.admit(at(1ms), kWall, 1));
  EXPECT_FALSE(admission.admit(at(2ms), kWall - 3ms, 1));
  EXPECT_EQ(admission.refused(Refusal::kNotRising), 2U);
  EXPECT_TRUE(admission.admit(at(4ms), kWall + 4ms, 1));
  EXPECT_EQ(admission.complaint("/pose")->field, "header.stamp");
}

TEST(Admission, ASystemClockThatIsSetBackDoesNotHoldUpTheStatesForLong) {
  Admission admission({});
  EXPECT_TRUE(admission.admit(at(0ms), kWall, 1));
  Moment later = at(5ms);
  later.wall -= 3600s;
  EXPECT_EQ(admission.admit(later, kWall - 3600s + 5ms, 1), Stamp(100s + 5ms));
}

TEST(Admission, OneProgramSpeaksAtATime) {
  Admission admission({});
  EXPECT_TRUE(admission.admit(at(0ms), kWall, 1));
  EXPECT_FALSE(admission.admit(at(5ms), kWall + 5ms, 2));
  EXPECT_EQ(admission.refused(Refusal::kTwoPrograms), 1U);
  EXPECT_THAT(admission.complaint("/pose")->message, HasSubstr("more than one program"));
  EXPECT_TRUE(admission.admit(at(505ms), kWall + 505ms, 2)) << "the first has fallen silent";
  EXPECT_FALSE(admission.admit(at(510ms), kWall + 510ms, 1));
}

TEST(Admission, SaysHowOftenMessagesCome) {
  Admission admission({});
  EXPECT_EQ(admission.rate_hz(), 0.0);
  for (Stamp t{0}; t < 1s; t += 4ms) EXPECT_TRUE(admission.admit(at(t), kWall + t, 1));
  EXPECT_NEAR(admission.rate_hz(), 250.0, 1.0);
}

TEST(Admission, AStrayRefusalIsNoReasonToComplain) {
  Admission admission({});
  admission.refuse(Refusal::kMalformed, Error::invalid("pose.position", "nan", "a number"));
  EXPECT_THAT(admission.complaint("/pose")->message, HasSubstr("pose.position is nan"));
  for (Stamp t{0}; t < 1s; t += 4ms) EXPECT_TRUE(admission.admit(at(t), kWall + t, 1));
  EXPECT_FALSE(admission.complaint("/pose"));
}

}  // namespace
}  // namespace gatefield::bridge::sources
