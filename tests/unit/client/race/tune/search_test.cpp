#include "client/race/tune/search.h"

#include <gtest/gtest.h>

#include "tests/unit/client/race/tune/sheets.h"

namespace gatefield::race {
namespace {

class SearchTest : public testing::Test {
 protected:
  SearchTest()
      : space_(
            std::move(Space::make({{"temperature", 0.1, 10, true}, {"unseen_speed_factor", 0.2, 1, false}}, sheet_of()))
                .value()) {
    tune_.candidates = 6;
  }
  /// Best where the temperature is low.
  static std::vector<Score> scores(const std::vector<ProfileSheet>& profiles) {
    std::vector<Score> out;
    for (const ProfileSheet& profile : profiles)
      out.push_back({1, 1, 1.0 / (1.0 + *profile.number("temperature")), 0, 0});
    return out;
  }
  Tune tune_;
  Space space_;
};

TEST_F(SearchTest, TheBaseFliesBesideTheCandidates) {
  Search search(tune_, space_);
  const std::vector<ProfileSheet> profiles = search.next();
  ASSERT_EQ(profiles.size(), 7u);
  EXPECT_EQ(profiles[0].name(), "base");
  EXPECT_EQ(profiles[6].name(), "c06");
  EXPECT_EQ(profiles[0].number("temperature"), 1.0);
  for (const ProfileSheet& profile : profiles) {
    EXPECT_GE(*profile.number("temperature"), 0.1);
    EXPECT_LE(*profile.number("unseen_speed_factor"), 1.0);
  }
}

TEST_F(SearchTest, GoesWhereScoresAreHighAndComesBackIntoTheRanges) {
  Search search(tune_, space_);
  for (int generation = 0; generation < 40; ++generation) search.take(scores(search.next()));
  EXPECT_EQ(search.generations().size(), 40u);
  EXPECT_EQ(search.generations().back().mean, search.found());
  EXPECT_LT(*space_.profile(search.found()).number("temperature"), 0.13);
  EXPECT_LT(Space::outside(search.found()), 0.01) << "beyond the range nothing is gained";
}

TEST_F(SearchTest, TheSameScoresGiveTheSameProfiles) {
  Search search(tune_, space_), again(tune_, space_);
  for (int generation = 0; generation < 4; ++generation) {
    const auto profiles = search.next(), others = again.next();
    for (std::size_t i = 0; i < profiles.size(); ++i) EXPECT_EQ(profiles[i].text(), others[i].text());
    search.take(scores(profiles));
    again.take(scores(others));
  }
  EXPECT_EQ(search.found(), again.found());
}

}  // namespace
}  // namespace gatefield::race
