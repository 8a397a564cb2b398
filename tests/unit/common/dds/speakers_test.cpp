#include "common/dds/speakers.h"

#include <gtest/gtest.h>

namespace gatefield::dds {
namespace {

using namespace std::chrono_literals;
using Fault = SampleFault;

ParticipantId participant(std::uint8_t number) {
  ParticipantId id;
  id.bytes[11] = number;
  return id;
}
const ParticipantId kVictim = participant(1), kStranger = participant(2);
constexpr Speakers::Instance kInstance{7};

/// The victim flies "drone" by its request 70.
class SpeakersTest : public ::testing::Test {
 protected:
  void SetUp() override {
    EXPECT_EQ(speakers_.may_ask(kVictim, "drone", 1s), Fault::kNone);
    EXPECT_TRUE(speakers_.claim(kVictim, "drone", 70, kInstance));
    speakers_.bind("drone", 70);
  }
  Fault speaks(const ParticipantId& who, const char* vehicle = "drone", std::size_t bytes = 300) {
    return speakers_.may_speak(who, vehicle, bytes, 1s);
  }
  Speakers speakers_;
};

TEST_F(SpeakersTest, OnlyWhoAskedSpeaksForTheVehicle) {
  EXPECT_EQ(speaks(kVictim), Fault::kNone);
  EXPECT_EQ(speaks(kStranger), Fault::kStranger);
  EXPECT_EQ(speaks(kVictim, "another"), Fault::kStranger) << "nobody has asked for that one";
  EXPECT_EQ(speaks(kVictim, ""), Fault::kNone) << "disposes of something of its own";
  EXPECT_EQ(speaks(kStranger, ""), Fault::kStranger);
}

TEST_F(SpeakersTest, AnOverheardNumberIsNotTakenFromAnother) {
  EXPECT_EQ(speakers_.may_ask(kStranger, "drone", 1s), Fault::kNone);
  EXPECT_FALSE(speakers_.claim(kStranger, "drone", 70, kInstance));
  speakers_.bind("drone", 70);  // the answer is given again
  EXPECT_EQ(speaks(kVictim), Fault::kNone);
  EXPECT_EQ(speaks(kStranger), Fault::kStranger);
}

TEST_F(SpeakersTest, AnotherRequestTakesTheSessionOverWhenItIsAccepted) {
  EXPECT_EQ(speakers_.may_ask(kStranger, "drone", 1s), Fault::kNone);
  EXPECT_TRUE(speakers_.claim(kStranger, "drone", 71, kInstance));
  EXPECT_EQ(speaks(kStranger), Fault::kStranger) << "it was only asked for";
  speakers_.bind("drone", 71);
  EXPECT_EQ(speaks(kStranger), Fault::kNone);
  EXPECT_EQ(speaks(kVictim), Fault::kStranger);
}

TEST_F(SpeakersTest, NobodySpeaksWhenTheSessionIsOver) {
  speakers_.unbind("drone");
  EXPECT_EQ(speaks(kStranger), Fault::kStranger);
  EXPECT_EQ(speaks(kVictim), Fault::kElsewhere) << "it asked here, too, and another server flies it";
  speakers_.bind("drone", 70);
  EXPECT_EQ(speaks(kVictim), Fault::kNone) << "its request is still there";
}

TEST_F(SpeakersTest, ARequestIsWithdrawnByWhoMadeIt) {
  EXPECT_FALSE(speakers_.release(kStranger, kInstance));
  const auto gone = speakers_.release(kVictim, kInstance);
  ASSERT_TRUE(gone);
  EXPECT_EQ(gone->vehicle, "drone");
  EXPECT_EQ(gone->number, 70u);
  EXPECT_FALSE(speakers_.release(kVictim, kInstance)) << "once";
}

TEST_F(SpeakersTest, AParticipantThatGoesTakesItsRequestsWithIt) {
  EXPECT_EQ(speakers_.may_ask(kVictim, "second", 1s), Fault::kNone);
  EXPECT_TRUE(speakers_.claim(kVictim, "second", 71, {}));
  EXPECT_EQ(speakers_.forget(kStranger).size(), 0u);
  EXPECT_EQ(speakers_.forget(kVictim).size(), 2u);
  EXPECT_EQ(speakers_.may_ask(kStranger, "drone", 1s), Fault::kNone);
  EXPECT_TRUE(speakers_.claim(kStranger, "drone", 70, {})) << "a number of nobody's";
}

TEST_F(SpeakersTest, OneAsksForSoManyVehiclesAndOthersDont) {
  const std::size_t most = SpeakerLimits().names;
  for (std::size_t i = 0; i < most; ++i)
    EXPECT_EQ(speakers_.may_ask(kStranger, "crowd-" + std::to_string(i), 1s), Fault::kNone);
  EXPECT_EQ(speakers_.may_ask(kStranger, "one-more", 1s), Fault::kTooManyNames);
  EXPECT_EQ(speakers_.may_ask(kStranger, "crowd-0", 1s), Fault::kNone) << "again for one of them";
  EXPECT_EQ(speakers_.may_ask(participant(3), "one-more", 1s), Fault::kNone);
  EXPECT_TRUE(speakers_.claim(kStranger, "crowd-0", 5, kInstance));
  EXPECT_TRUE(speakers_.release(kStranger, kInstance));
  EXPECT_EQ(speakers_.may_ask(kStranger, "one-more", 1s), Fault::kNone) << "there is room again";
}

TEST_F(SpeakersTest, AllTogetherAreBounded) {
  std::size_t taken = 0;
  for (std::uint8_t who = 3; who < 250; ++who)
    for (int i = 0; i < 8; ++i)
      if (speakers_.may_ask(participant(who), "v" + std::to_string(who) + "-" + std::to_string(i), 1s) == Fault::kNone)
        ++taken;
  EXPECT_EQ(taken, kMaxRemembered - 1);
  EXPECT_EQ(speaks(kVictim), Fault::kNone);
}

TEST_F(SpeakersTest, RequestsAndSamplesHaveARate) {
  std::size_t taken = 0;
  for (int i = 0; i < 1000; ++i) taken += speakers_.may_ask(kStranger, "drone", 2s) == Fault::kNone;
  EXPECT_EQ(taken, static_cast<std::size_t>(SpeakerLimits().requests_per_s));
  EXPECT_EQ(speakers_.may_ask(kStranger, "drone", 2s), Fault::kTooOften);
  EXPECT_EQ(speakers_.may_ask(kStranger, "drone", 2s + 20ms), Fault::kNone);
  EXPECT_EQ(speakers_.may_ask(kVictim, "drone", 2s), Fault::kNone) << "nobody pays for another";

  taken = 0;
  for (int i = 0; i < 10'000; ++i) taken += speaks(kVictim) == Fault::kNone;
  EXPECT_EQ(taken, static_cast<std::size_t>(SpeakerLimits().samples_per_s));
  EXPECT_EQ(speakers_.may_speak(kVictim, "drone", 300, 2s), Fault::kNone);
  EXPECT_EQ(speakers_.may_speak(kVictim, "drone", 2'000'000'000, 4s), Fault::kTooOften) << "bytes have one, too";
}

TEST_F(SpeakersTest, BytesOfAllVehiclesOfAParticipantCountTogether) {
  EXPECT_EQ(speakers_.may_ask(kVictim, "second", 1s), Fault::kNone);
  EXPECT_TRUE(speakers_.claim(kVictim, "second", 71, {}));
  speakers_.bind("second", 71);
  EXPECT_EQ(speakers_.may_speak(kVictim, "drone", 600'000'000, 2s), Fault::kNone);
  EXPECT_EQ(speakers_.may_speak(kVictim, "second", 600'000'000, 2s), Fault::kTooOften);
  EXPECT_EQ(speakers_.may_speak(kVictim, "second", 300'000'000, 2s), Fault::kNone);
}

TEST_F(SpeakersTest, LargeSamplesInFragmentsTakeASession) {
  EXPECT_TRUE(speakers_.may_send_fragments(kStranger, 7'000)) << "a request";
  EXPECT_FALSE(speakers_.may_send_fragments(kStranger, 6'000'000)) << "memory is set aside for the first fragment";
  EXPECT_TRUE(speakers_.may_send_fragments(kVictim, 6'000'000));
}

}  // namespace
}  // namespace gatefield::dds
