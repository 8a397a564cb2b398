// The campaign of docs/racing.md, with the course of docs/courses-and-vehicles.md beside it.
#include "client/race/campaign.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <map>
#include <string>

#include "tests/examples/page.h"

namespace gatefield::race {
namespace {

using std::filesystem::path;
const path kDocs = path(GATEFIELD_SOURCE_DIR) / "docs";

class RacingPage : public testing::Test {
 protected:
  RacingPage()
      : files_(test::shown_files(kDocs / "racing.md")),
        folder_(std::filesystem::temp_directory_path() / ("gatefield-racing-" + std::to_string(getpid()))) {
    test::write_files(test::shown_files(kDocs / "courses-and-vehicles.md"), folder_);
    test::write_files(files_, folder_);
  }
  ~RacingPage() override { std::filesystem::remove_all(folder_); }

  std::map<std::string, std::string> files_;
  path folder_;
};

TEST_F(RacingPage, TheCampaignLoads) {
  const auto campaign = load_campaign(folder_ / "my/hall-campaign.txt");
  ASSERT_TRUE(campaign) << campaign.error();
  EXPECT_EQ(campaign->cells.size(), 3u);
}

TEST_F(RacingPage, AMistakeIsAnsweredAsThePageSays) {
  std::string text = files_.at("my/hall-campaign.txt");
  const std::string piece = "position_m: 0.4";
  test::write_files({{"my/hall-campaign.txt", text.replace(text.find(piece), piece.size(), "position_m: 9")}}, folder_);
  const auto campaign = load_campaign(folder_ / "my/hall-campaign.txt");
  ASSERT_FALSE(campaign);
  const std::string sentence =
      campaign.error().substr(folder_.string().size() + 1);  // the page's reader is in the folder
  EXPECT_THAT(test::text_of(kDocs / "racing.md"), testing::HasSubstr('\n' + sentence + '\n'));
}

}  // namespace
}  // namespace gatefield::race
