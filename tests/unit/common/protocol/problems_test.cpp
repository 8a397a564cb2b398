#include "common/protocol/problems.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>
#include <string>

namespace gatefield::protocol {
namespace {

using testing::ElementsAre;

TEST(Problems, EachHasANameAndASentenceOfItsOwn) {
  std::set<std::string> names, sentences;
  for (int i = 0; i < kProblems; ++i) {
    const auto problem = static_cast<Problem>(i);
    EXPECT_FALSE(name(problem).empty()) << i;
    EXPECT_FALSE(sentence(problem).empty()) << i;
    names.emplace(name(problem));
    sentences.emplace(sentence(problem));
  }
  EXPECT_EQ(names.size(), static_cast<std::size_t>(kProblems));
  EXPECT_EQ(sentences.size(), static_cast<std::size_t>(kProblems));
}

TEST(Problems, NumbersOnTheWireStay) {
  EXPECT_EQ(name(static_cast<Problem>(0)), "gate_not_seen");
  EXPECT_EQ(name(static_cast<Problem>(9)), "states_look_ned");
  EXPECT_EQ(name(static_cast<Problem>(22)), "deadlines_missed");
}

TEST(Problems, AreListedByNumberAndUnknownBitsAreLeftOut) {
  const Problems some = bit(Problem::kDepthMissing) | bit(Problem::kGateNotSeen) | (Problems{1} << 60);
  EXPECT_THAT(list(some), ElementsAre(Problem::kGateNotSeen, Problem::kDepthMissing));
  EXPECT_THAT(list(0), ElementsAre());
}

}  // namespace
}  // namespace gatefield::protocol
