#include "client/race/campaign_run.h"

#include <gmock/gmock.h>

#include "client/race/files.h"
#include "client/race/trial_log.h"
#include "tests/unit/client/race/fixtures.h"

namespace gatefield::race {
namespace {

using testing::HasSubstr;

class CampaignRun : public testing::Test {
 protected:
  CampaignRun() {
    std::filesystem::create_directories(folder_.path() / "profiles");
    std::filesystem::create_directories(folder_.path() / "model");
    folder_.put("profiles/race.txt", "name: \"race\"");
    folder_.put("model/manifest.txt", "name: \"x\"");
    for (Cell& cell : campaign_.cells) cell.model = (folder_.path() / "model").string();
    request_.folder = folder_.path() / "out";
    request_.server.profiles = folder_.path() / "profiles";
    request_.paths = 1;
    request_.pictures = 0;
  }
  RunSummary fly() {
    const auto plan = plan_run(campaign_, request_);
    EXPECT_TRUE(plan.ok()) << plan.error();
    return run_campaign(
        campaign_, request_, *plan, [](int) { return std::make_unique<FakeFlyer>(); }, stop_);
  }
  std::size_t left() {
    const auto plan = plan_run(campaign_, request_);
    EXPECT_TRUE(plan.ok()) << plan.error();
    return plan->trials.size();
  }

  Campaign campaign_ = campaign_of(kTwoCells);
  Folder folder_;
  RunRequest request_;
  std::atomic<bool> stop_{false};
};

TEST_F(CampaignRun, GoesOnWhereItWas) {
  request_.limit = 5;
  EXPECT_EQ(fly().flown, 5u);
  request_.limit.reset();
  EXPECT_EQ(left(), 7u);
  EXPECT_EQ(fly().flown, 7u);
  EXPECT_EQ(left(), 0u);
  EXPECT_EQ(fly().flown, 0u);
  EXPECT_EQ(read_trials(request_.folder)->size(), 12u);
  EXPECT_TRUE(std::filesystem::exists(request_.folder / "cells/b.course.txt"));
  EXPECT_TRUE(std::filesystem::exists(request_.folder / "paths/a-6-5.csv"));
  EXPECT_FALSE(std::filesystem::exists(request_.folder / "paths/a-6-7.csv")) << "won, and not the first";
  EXPECT_TRUE(std::filesystem::exists(request_.folder / "paths/a-6-6.csv")) << "lost";
}

TEST_F(CampaignRun, TrialsThatLostTheirServerAreFlownAgain) {
  auto log = TrialLog::open(request_.folder / "trials.csv");
  TrialResult lost = result_of(trials_of(campaign_)[0]);
  lost.failure = Failure::kLostServer;
  ASSERT_TRUE(log.value()->append(lost).ok());
  log.value().reset();
  EXPECT_EQ(left(), 12u);
}

TEST_F(CampaignRun, ChangedProfilesModelsAndScenariosAreNotMixed) {
  request_.limit = 1;
  fly();
  folder_.put("profiles/race.txt", "name: \"race\" samples: 4096");
  EXPECT_THAT(plan_run(campaign_, request_).error(), HasSubstr("'a at 6 m/s, seed 5' was flown with another program"));
  request_.allow_mixed = true;
  EXPECT_TRUE(plan_run(campaign_, request_).ok());
  request_.allow_mixed = false;
  folder_.put("profiles/race.txt", "name: \"race\"");
  EXPECT_TRUE(plan_run(campaign_, request_).ok());
  folder_.put("model/decoder.onnx", "other weights");
  EXPECT_FALSE(plan_run(campaign_, request_).ok());
  std::filesystem::remove(folder_.path() / "model/decoder.onnx");
  campaign_.cells[0].link.each_way_ms = 10;
  EXPECT_FALSE(plan_run(campaign_, request_).ok());
}

TEST_F(CampaignRun, AnotherSeedOfThePlannerIsAnotherFlight) {
  request_.limit = 1;
  fly();
  request_.selection.planner_seed = 99;
  EXPECT_THAT(plan_run(campaign_, request_).error(), HasSubstr("'a at 6 m/s, seed 5' was flown with another program"));
  request_.folder = folder_.path() / "other";
  fly();
  EXPECT_EQ(read_trials(request_.folder)->front().planner_seed, 99u);
}

TEST_F(CampaignRun, TruePosesFlyWithAnySeedOfThePlanner) {
  campaign_.cells[0].perception = Perception::kTruePose;
  request_.selection.planner_seed = 99;
  EXPECT_EQ(left(), 12u);
}

TEST_F(CampaignRun, AProfileOrModelThatIsNotThereIsSaidBeforeAnythingFlies) {
  campaign_.cells[1].profile = "warp";
  EXPECT_THAT(plan_run(campaign_, request_).error(), HasSubstr("cell 'b': profile is 'warp', expected one of"));
  campaign_.cells[1].profile = "race";
  campaign_.cells[1].model = "/nowhere";
  EXPECT_THAT(plan_run(campaign_, request_).error(), HasSubstr("model '/nowhere' is neither"));
}

TEST_F(CampaignRun, ShardsOfTwoMachinesMergeIntoTheWhole) {
  const auto out = request_.folder;
  for (int index = 1; index <= 2; ++index) {
    request_.selection.shard = {index, 2};
    request_.folder = folder_.path() / ("host" + std::to_string(index));
    EXPECT_EQ(fly().flown, 6u);
  }
  const auto merged = merge_results({folder_.path() / "host1", folder_.path() / "host2"}, out, false);
  ASSERT_TRUE(merged.ok()) << merged.error();
  EXPECT_EQ(*merged, 12u);
  request_.selection.shard = {};
  request_.folder = out;
  EXPECT_EQ(left(), 0u);
  EXPECT_TRUE(std::filesystem::exists(out / "paths/a-6-5.csv"));
  EXPECT_THAT(merge_results({folder_.path() / "host1"}, out, false).error(), HasSubstr("is there already"));
  EXPECT_EQ(*merge_results({folder_.path() / "host1", out}, out, false), 12u);
}

TEST_F(CampaignRun, MergingRefusesWhatDoesNotBelongTogether) {
  request_.selection.shard = {1, 2};
  request_.folder = folder_.path() / "host1";
  fly();
  folder_.put("profiles/race.txt", "name: \"race\" samples: 4096");
  request_.selection.shard = {2, 2};
  request_.folder = folder_.path() / "host2";
  fly();
  const std::vector<std::filesystem::path> both{folder_.path() / "host1", folder_.path() / "host2"};
  EXPECT_THAT(merge_results(both, folder_.path() / "all", false).error(), HasSubstr("different programs"));
  EXPECT_TRUE(merge_results(both, folder_.path() / "all", true).ok());
  EXPECT_THAT(merge_results({folder_.path() / "profiles"}, folder_.path() / "none", false).error(),
              HasSubstr("has no results"));
}

}  // namespace
}  // namespace gatefield::race
