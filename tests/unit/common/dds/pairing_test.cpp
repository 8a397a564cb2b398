#include "common/dds/pairing.h"

#include <gtest/gtest.h>

namespace gatefield::dds {
namespace {

ParticipantId participant(std::uint8_t number) {
  ParticipantId id;
  id.bytes[0] = number;
  return id;
}
const ParticipantId kFirst = participant(1), kSecond = participant(2);

TEST(Pairing, AnnouncesWhatItIs) {
  EXPECT_EQ(Pairing("a", {.heir = "b"}).announcement(), "gatefield-server:a:serving");
  EXPECT_EQ(Pairing("b", {.leader = "a"}).announcement(), "gatefield-server:b:standby-of:a");
  EXPECT_TRUE(Pairing("b", {}).is_namesake("gatefield-server:b:standby-of:a"));
  EXPECT_FALSE(Pairing("b", {}).is_namesake("gatefield-server:bb:serving"));
}

TEST(Pairing, ReadsWhoAnnouncesItself) {
  EXPECT_EQ(Pairing::server_in("gatefield-server:a:serving"), "a");
  EXPECT_EQ(Pairing::server_in("gatefield-server:b:standby-of:a"), "b");
  EXPECT_EQ(Pairing::server_in("gatefield-server:b"), "b");
  EXPECT_EQ(Pairing::server_in("gatefield-client:a"), "");
  EXPECT_EQ(Pairing::server_in(""), "");
}

TEST(Pairing, TheHeirIsTheFirstOfItsNameThatStandsByForUs) {
  Pairing pairing("a", {.heir = "b"});
  EXPECT_FALSE(pairing.appeared(kFirst, "gatefield-server:b:serving").heir) << "stands by for nobody";
  EXPECT_FALSE(pairing.appeared(kFirst, "gatefield-server:b:standby-of:c").heir);
  EXPECT_FALSE(pairing.appeared(kFirst, "gatefield-server:c:standby-of:a").heir) << "not told of that one";
  EXPECT_FALSE(pairing.heir());
  EXPECT_TRUE(pairing.appeared(kFirst, "gatefield-server:b:standby-of:a").heir);
  EXPECT_FALSE(pairing.appeared(kFirst, "gatefield-server:b:standby-of:a").heir) << "is announced again and again";
  EXPECT_FALSE(pairing.appeared(kSecond, "gatefield-server:b:standby-of:a").heir) << "the first one is there";
  EXPECT_EQ(pairing.heir(), kFirst);
  EXPECT_FALSE(pairing.gone(participant(3)).heir);
  EXPECT_TRUE(pairing.gone(kFirst).heir);
  EXPECT_EQ(pairing.heir(), kSecond);
  EXPECT_TRUE(pairing.gone(kSecond).heir);
  EXPECT_FALSE(pairing.heir());
}

TEST(Pairing, WhoWasNotToldOfAnHeirHasNone) {
  Pairing pairing("a", {});
  EXPECT_FALSE(pairing.appeared(kFirst, "gatefield-server:b:standby-of:a").heir);
  EXPECT_FALSE(pairing.appeared(kFirst, "gatefield-server::standby-of:a").heir);
  EXPECT_FALSE(pairing.heir());
}

TEST(Pairing, TheLeaderIsWhoHasItsNameWhetherItStandsByOrNot) {
  Pairing pairing("b", {.leader = "a"});
  EXPECT_TRUE(pairing.appeared(kFirst, "gatefield-server:a:standby-of:b").leader);
  EXPECT_FALSE(pairing.appeared(kSecond, "gatefield-server:a:serving").leader);
  EXPECT_EQ(pairing.leader(), kFirst);
  EXPECT_TRUE(pairing.gone(kFirst).leader);
  EXPECT_EQ(pairing.leader(), kSecond);
}

TEST(Pairing, OfTwoEqualsTheFirstInTheAlphabetHasTheNewcomers) {
  Pairing a("a", {.heir = "b", .leader = "b"}), b("b", {.heir = "a", .leader = "a"});
  EXPECT_FALSE(a.goes_first()) << "there is no other one";
  a.appeared(kFirst, b.announcement());
  b.appeared(kSecond, a.announcement());
  EXPECT_EQ(a.heir(), kFirst);
  EXPECT_EQ(a.leader(), kFirst);
  EXPECT_TRUE(a.goes_first());
  EXPECT_FALSE(b.goes_first());
  a.gone(kFirst);
  EXPECT_FALSE(a.goes_first());
  a.appeared(kSecond, "gatefield-server:b:serving");
  EXPECT_FALSE(a.goes_first()) << "it leads, and does not stand by";
}

TEST(Pairing, RemembersNoEndOfCandidates) {
  Pairing pairing("b", {.leader = "a"});
  for (std::uint8_t i = 1; i <= 100; ++i) pairing.appeared(participant(i), "gatefield-server:a:serving");
  for (std::uint8_t i = 1; i <= 16; ++i) pairing.gone(participant(i));
  EXPECT_FALSE(pairing.leader());
}

}  // namespace
}  // namespace gatefield::dds
