#include "client/race/trial_log.h"

#include <gmock/gmock.h>

#include <thread>

#include "client/race/files.h"
#include "tests/unit/client/race/fixtures.h"

namespace gatefield::race {
namespace {

using testing::HasSubstr;

class Log : public testing::Test {
 protected:
  TrialResult result(std::uint64_t seed) const { return result_of({&campaign_.cells[0], 6, seed}); }
  std::filesystem::path file() const { return folder_.path() / "trials.csv"; }
  void fill(std::uint64_t first, std::uint64_t last) const {
    auto log = TrialLog::open(file());
    ASSERT_TRUE(log.ok()) << log.error();
    for (auto seed = first; seed <= last; ++seed) ASSERT_TRUE(log.value()->append(result(seed)).ok());
  }
  Campaign campaign_ = campaign_of(kTwoCells);
  Folder folder_;
};

TEST_F(Log, GrowsFromRunToRun) {
  EXPECT_TRUE(read_trials(folder_.path())->empty());
  fill(1, 2);
  fill(3, 3);
  const auto all = read_trials(folder_.path());
  ASSERT_TRUE(all.ok()) << all.error();
  ASSERT_EQ(all->size(), 3u);
  EXPECT_EQ((*all)[2].seed, 3u);
}

TEST_F(Log, AnUnfinishedLineIsNotThereAndIsCutOff) {
  fill(1, 2);
  const std::string whole = read_file(file()).value();
  std::ofstream(file(), std::ios::app) << "a,6,3,1,won,fini";
  EXPECT_EQ(read_trials(folder_.path())->size(), 2u);
  fill(4, 4);
  EXPECT_TRUE(read_file(file())->starts_with(whole + "a,6,4,"));
  EXPECT_EQ(read_trials(folder_.path())->size(), 3u);
}

TEST_F(Log, HasOneWriterAtATime) {
  const auto first = TrialLog::open(file());
  ASSERT_TRUE(first.ok());
  EXPECT_THAT(TrialLog::open(file()).error(), HasSubstr("another gatefield-race"));
}

TEST_F(Log, OtherFilesAreLeftAlone) {
  std::ofstream(file()) << "my,table\n1,2\n";
  EXPECT_THAT(TrialLog::open(file()).error(), HasSubstr("trials.csv:1: is not the header"));
  EXPECT_EQ(*read_file(file()), "my,table\n1,2\n");
  EXPECT_THAT(read_trials(folder_.path()).error(), HasSubstr("trials.csv:1:"));
}

TEST_F(Log, ABrokenLineIsNamed) {
  fill(1, 1);
  std::ofstream(file(), std::ios::app) << "nonsense\n";
  EXPECT_THAT(read_trials(folder_.path()).error(), HasSubstr("trials.csv:3: there are 1 columns"));
}

TEST_F(Log, ATrialThatWasFlownCountsMoreThanOneThatLostItsServer) {
  TrialResult lost = result(2), flown = result(2);
  lost.failure = Failure::kLostServer;
  {
    auto log = TrialLog::open(file());
    ASSERT_TRUE(log.value()->append(lost).ok());
    ASSERT_TRUE(log.value()->append(flown).ok());
    ASSERT_TRUE(log.value()->append(lost).ok());
  }
  const auto all = read_trials(folder_.path());
  ASSERT_EQ(all->size(), 1u);
  EXPECT_TRUE((*all)[0].won());
}

TEST_F(Log, LinesOfManyThreadsStayWhole) {
  {
    auto log = TrialLog::open(file());
    std::vector<std::thread> threads;
    for (std::uint64_t t = 0; t < 4; ++t)
      threads.emplace_back([&, t] {
        for (std::uint64_t i = 1; i <= 25; ++i) EXPECT_TRUE(log.value()->append(result(100 * t + i)).ok());
      });
    for (auto& thread : threads) thread.join();
  }
  const auto all = read_trials(folder_.path());
  ASSERT_TRUE(all.ok()) << all.error();
  EXPECT_EQ(all->size(), 100u);
}

TEST_F(Log, ShardsHaveFilesOfTheirOwnAndAreReadTogether) {
  EXPECT_EQ(log_name({1, 1}), "trials.csv");
  for (int index = 1; index <= 2; ++index) {
    auto log = TrialLog::open(folder_.path() / log_name({index, 2}));
    ASSERT_TRUE(log.value()->append(result(static_cast<std::uint64_t>(index))).ok());
  }
  EXPECT_EQ(read_trials(folder_.path())->size(), 2u);
}

}  // namespace
}  // namespace gatefield::race
