#include "client/race/report.h"

#include <gmock/gmock.h>

#include "client/race/files.h"
#include "client/race/trial_log.h"
#include "tests/unit/client/race/flown.h"

namespace gatefield::race {
namespace {

using testing::HasSubstr;

using Reports = Flown;

TEST_F(Reports, AreFilesOfAFolder) {
  Folder folder;
  ASSERT_TRUE(save_campaign(campaign_, folder.path()).ok());
  {
    auto log = TrialLog::open(folder.path() / "trials.csv");
    for (const auto& result : results_) ASSERT_TRUE(log.value()->append(result).ok());
  }
  const std::string path =
      "t_s,x_m,y_m,z_m,speed_m_s\n0.000,5.0000,-2.5000,1.5000,5.000\n1.000,5.0000,2.5000,1.5000,5.000\n";
  ASSERT_TRUE(put_file(folder.path() / "paths/a-6-5.csv", path).ok());

  const auto files = write_report(folder.path());
  ASSERT_TRUE(files.ok()) << files.error();
  EXPECT_THAT(files->text, HasSubstr("75"));
  const std::string page = read_file(files->folder / "report.md").value();
  EXPECT_THAT(page, HasSubstr("12 races."));
  EXPECT_THAT(page, HasSubstr("Failures by kind"));
  EXPECT_THAT(page, HasSubstr("figures/a-flights.png"));
  EXPECT_GT(std::filesystem::file_size(files->folder / "figures/a-flights.png"), 10'000u);
  for (const char* name :
       {"table.txt", "table.md", "table.csv", "comparison.csv", "pace.csv", "failures.md", "failures-to-fly.txt",
        "figures/success.csv", "figures/success.gp", "figures/position-failures.csv"})
    EXPECT_TRUE(std::filesystem::exists(files->folder / name)) << name;
  EXPECT_THAT(*read_file(files->folder / "table.csv"), HasSubstr("first,race,6,4,3,75,"));
}

TEST_F(Reports, SayWhenTrialsDoNotBelongTogether) {
  Folder folder;
  ASSERT_TRUE(save_campaign(campaign_, folder.path()).ok());
  auto log = TrialLog::open(folder.path() / "trials.csv");
  results_[0].setup = 2;
  for (const auto& result : results_) ASSERT_TRUE(log.value()->append(result).ok());
  const auto files = write_report(folder.path());
  ASSERT_TRUE(files.ok()) << files.error();
  ASSERT_FALSE(files->remarks.empty());
  EXPECT_THAT(files->remarks[0], HasSubstr("a at 8 m/s mixes trials"));
}

TEST_F(Reports, AFolderWithoutACampaignIsSaid) {
  EXPECT_THAT(write_report("/nowhere").error(), HasSubstr("/nowhere/campaign.txt: does not exist"));
}

}  // namespace
}  // namespace gatefield::race
