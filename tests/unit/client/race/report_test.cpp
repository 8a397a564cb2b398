#include "client/race/report.h"

#include <gmock/gmock.h>

#include "client/race/files.h"
#include "client/race/trial_log.h"
#include "tests/unit/client/race/fixtures.h"

namespace gatefield::race {
namespace {

using testing::HasSubstr;

TEST(Wilson, IsTheIntervalOfTheBooks) {
  // R: binom::binom.confint(x, n, methods = "wilson")
  EXPECT_NEAR(wilson(8, 10).low, 0.4901625, 1e-6);
  EXPECT_NEAR(wilson(8, 10).high, 0.9433178, 1e-6);
  EXPECT_NEAR(wilson(20, 20).low, 0.8388748, 1e-6);
  EXPECT_EQ(wilson(20, 20).high, 1.0);
  EXPECT_EQ(wilson(0, 20).low, 0.0);
  EXPECT_NEAR(wilson(0, 20).high, 0.1611252, 1e-6);
  EXPECT_NEAR(wilson(98, 100).low, 0.9299, 1e-4);
  EXPECT_EQ(wilson(0, 0).low, 0.0);
  EXPECT_EQ(wilson(0, 0).high, 1.0);
}

class Reports : public testing::Test {
 protected:
  Reports() {
    for (const Trial& trial : trials_of(campaign_)) {
      results_.push_back(result_of(trial));
      results_.back().setup = 1;
    }
  }
  Campaign campaign_ = campaign_of(R"(
    title: "Two"
    defaults { scenario: "circle" seeds { first: 5 last: 8 } laps: 1 }
    cell { name: "a" title: "first" speed_m_s: [8, 6] goal { speed_m_s: 6 success_percent: 90 }
           published { who: "Others" speed_m_s: 7 success_percent: 87 } }
    cell { name: "b" speed_m_s: 7 perturbation { position_m: 0.3 } figure: "position" link { each_way_ms: 20 } }
    figure { name: "position" against: POSITION }
  )");
  std::vector<TrialResult> results_;
};

TEST(Perceptions, ComparesTheSeedsThatAllHaveFlown) {
  const Campaign campaign = campaign_of(R"(
    defaults { scenario: "circle" seeds { first: 1 last: 5 } speed_m_s: 8 }
    cell { name: "field" }
    cell { name: "truth" beside: "field" perception: TRUE_POSE }
    cell { name: "alone" }
  )");
  std::vector<TrialResult> results;
  const auto add = [&](const Cell& cell, std::uint64_t seed, bool won) {
    results.push_back(result_of({&cell, 8, seed}));
    results.back().failure = won ? Failure::kNone : Failure::kTargetGate;
    results.back().cause = won ? Cause::kNone : Cause::kPerceptionWrong;
    results.back().belief_error_m = 0.5;
  };
  //                  seed 1 both won, 2 the field's fault, 3 control's, 4 the truth's bad luck, 5 not flown by both
  const bool field[] = {true, false, false, true, false}, truth[] = {true, true, false, false};
  for (std::uint64_t i = 0; i < 5; ++i) add(campaign.cells[0], i + 1, field[i]);
  for (std::uint64_t i = 0; i < 4; ++i) add(campaign.cells[1], i + 1, truth[i]);
  add(campaign.cells[2], 1, true);

  const auto table = perception_table(campaign, results);
  ASSERT_EQ(table.rows.size(), 1u);
  std::vector<std::string> row;
  for (const auto& cell : table.rows[0]) row.push_back(cell.text);
  // cell, speed, seeds, no vision, classical, learned, true pose, lost by perception, lost with both
  EXPECT_EQ(row[2], "4");
  EXPECT_EQ(row[5], "50");
  EXPECT_EQ(row[6], "50");
  EXPECT_EQ(row[7], "1");
  EXPECT_EQ(row[8], "1");

  const auto causes = cause_table(campaign, summarize(campaign, results), results);
  ASSERT_EQ(causes.rows.size(), 2u);
  EXPECT_EQ(causes.rows[0][3].text, "3");
  EXPECT_EQ(causes.rows[0][4].text, "3") << "perception wrong";
}

TEST_F(Reports, CountByCellAndSpeed) {
  const auto lines = summarize(campaign_, results_);
  ASSERT_EQ(lines.size(), 3u);
  EXPECT_EQ(lines[1].cell, "a");
  EXPECT_EQ(lines[1].speed_m_s, 6);
  EXPECT_EQ(lines[1].trials, 4u);
  EXPECT_EQ(lines[1].won, 3u);
  EXPECT_DOUBLE_EQ(lines[1].top_speed_m_s, 6.5);
  EXPECT_DOUBLE_EQ(lines[1].median_time_s, 5.875);
  EXPECT_EQ(lines[1].failures.at(Failure::kPassedBeside), 1u);

  const auto table = success_table(campaign_, lines);
  ASSERT_EQ(table.rows.size(), 3u);
  EXPECT_EQ(table.rows[1][0].text, "first");
  EXPECT_EQ(table.rows[1][5].text, "75");
  EXPECT_EQ(table.rows[1][6].text, "30");
  EXPECT_EQ(table.rows[1][7].text, "95");
  EXPECT_EQ(table.rows[1][8].text, "90");
  EXPECT_EQ(table.rows[0][8].text, "-") << "the goal is of the other speed";
  EXPECT_EQ(table.rows[1].back().text, "1 passed beside");
}

TEST_F(Reports, StandBesideWhatOthersPublished) {
  const auto table = comparison_table(campaign_, summarize(campaign_, results_));
  ASSERT_EQ(table.rows.size(), 1u);
  EXPECT_EQ(table.columns[1], "Others");
  EXPECT_EQ(table.rows[0][1].text, "87 % at 7 m/s");
  EXPECT_EQ(table.rows[0][2].text, "75 % (30 to 95)");
}

TEST_F(Reports, DrawSuccessAgainstWhatTheFigureAsksFor) {
  const auto lines = summarize(campaign_, results_);
  const auto speed = success_chart(campaign_, campaign_.figures[0], lines);
  ASSERT_EQ(speed.series.size(), 2u);
  EXPECT_EQ(speed.series[0].x, (std::vector<double>{6, 8})) << "in order, though the cell is not";
  EXPECT_EQ(speed.series[0].y, (std::vector<double>{75, 75}));
  EXPECT_EQ(speed.series[1].name, "Others: first");
  EXPECT_TRUE(plot::validate(speed).ok()) << plot::validate(speed).error();
  const auto position = success_chart(campaign_, campaign_.figures[1], lines);
  ASSERT_EQ(position.series.size(), 1u);
  EXPECT_EQ(position.series[0].x, std::vector<double>{0.3});
  const auto failures = failure_chart(campaign_, campaign_.figures[1], lines);
  ASSERT_EQ(failures.series.size(), 1u);
  EXPECT_TRUE(plot::validate(failures).ok()) << plot::validate(failures).error();
  EXPECT_EQ(failures.series[0].y[3], 25.0);
}

TEST_F(Reports, ListWhatWasLostWithTheLineThatFliesItAgain) {
  const std::string list = failure_list(campaign_, results_);
  EXPECT_THAT(list, HasSubstr("# a at 6 m/s, seed 6: not recorded, passed beside: missed gate 2"));
  EXPECT_THAT(list, HasSubstr("\ngatefield-sim --lockstep --scenario cells/b.txt --seed 6 --speed 7 --profile race "
                              "--laps 1 --delay-ms 40\n"));
  EXPECT_THAT(list, HasSubstr("at (1.00, 6.00, 1.50)"));
  EXPECT_THAT(list, testing::Not(HasSubstr("seed 5")));
}

TEST_F(Reports, AreFilesOfAFolder) {
  Folder folder;
  ASSERT_TRUE(save_campaign(campaign_, folder.path()).ok());
  {
    auto log = TrialLog::open(folder.path() / "trials.csv");
    for (const auto& result : results_) ASSERT_TRUE(log.value()->append(result).ok());
  }
  simulator::Report flown;
  for (int i = 0; i < 100; ++i) {
    flown.samples.emplace_back();
    flown.samples.back().t_s = 0.01 * i;
    flown.samples.back().state.p_WB = {5.0, 0.05 * i - 2.5, 1.5};
  }
  const std::string path = path_text(flown);
  EXPECT_EQ(std::count(path.begin(), path.end(), '\n'), 1 + 25 + 1) << path;
  ASSERT_TRUE(put_file(folder.path() / "paths/a-6-5.csv", path).ok());

  const auto files = write_report(folder.path());
  ASSERT_TRUE(files.ok()) << files.error();
  EXPECT_THAT(files->text, HasSubstr("75"));
  const std::string page = read_file(files->folder / "report.md").value();
  EXPECT_THAT(page, HasSubstr("12 races."));
  EXPECT_THAT(page, HasSubstr("Failures by kind"));
  EXPECT_THAT(page, HasSubstr("figures/a-flights.png"));
  EXPECT_GT(std::filesystem::file_size(files->folder / "figures/a-flights.png"), 10'000u);
  for (const char* name : {"table.txt", "table.md", "table.csv", "comparison.csv", "failures.md", "failures-to-fly.txt",
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
