#include "client/race/tune/tune_run.h"

#include <gmock/gmock.h>

#include <map>

#include "client/race/campaign.h"
#include "client/race/files.h"
#include "client/race/trial_log.h"
#include "tests/unit/client/race/fixtures.h"
#include "tests/unit/client/race/tune/sheets.h"

namespace gatefield::race {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

/// Flights whose worth follows from the profile that the server would have read: the nearer to temperature 0.3 and
/// margin 0.2 m, the more clearance; far away races are lost.
class TuneRunTest : public testing::Test {
 protected:
  TuneRunTest() {
    fs::create_directories(folder_.path() / "model");
    folder_.put("model/manifest.txt", "name: \"x\"");
    auto tune = load_tune(folder_.put("tune.txt", R"(
      title: "Try"
      profile: "lab"
      races { cell { name: "a" scenario: "circle" speed_m_s: [6, 8] laps: 1 seeds { first: 1 last: 10 } } }
      field { name: "temperature" min: 0.1 max: 10 } field { name: "crossing_margin_m" min: 0.02 max: 0.5 }
      candidates: 6 seeds_per_generation: 2 fresh_seeds { first: 11 last: 16 } trials: 108
    )"));
    EXPECT_TRUE(tune.ok()) << tune.error();
    tune_ = std::move(tune).value();
    for (Cell& cell : tune_.races.cells) cell.model = (folder_.path() / "model").string();
    request_.runner.workers = 3;
    request_.pictures = 0;
  }

  Flight fly(const ServerOptions& server, const Trial& trial) const {
    const auto text = read_file(server.profiles / (trial.cell->profile + ".txt"));
    EXPECT_TRUE(text.ok()) << text.error();
    const auto value = [&text](const std::string& field) {
      return std::stod(text->substr(text->find("\n" + field + ": ") + field.size() + 3));
    };
    const double t = std::log(value("temperature") / 0.3), m = std::log(value("crossing_margin_m") / 0.2);
    const double off = t * t + m * m;
    Flight flight;
    flight.end = Flight::End::kFlown;
    simulator::Report report;
    const bool won = off < 4.0;
    report.outcome = won ? simulator::Outcome::kFinished : simulator::Outcome::kMissedGate;
    report.gates_total = 4;
    report.passes.resize(won ? 4 : 1);
    report.race_time_s = 6.0 + 0.01 * static_cast<double>(trial.seed);
    report.clearance_m = std::max(0.0, 0.18 - 0.04 * off);
    report.samples.resize(1);
    report.end_state.p_WB = trial.cell->scenario.track.course.waypoints[1].p_W;
    flight.result = to_result(trial, report);
    flight.report = report;
    return flight;
  }

  /// @param limit  the run is stopped after so many flights
  TuneSummary run(const std::string& out, int limit = 1 << 30) {
    request_.set_folder(folder_.path() / out);
    std::atomic<bool> stop{false};
    std::atomic<int> flown{0};
    const FlyersFor flyers = [&](const ServerOptions& server) -> FlyerFactory {
      return [&, server](int) {
        return std::make_unique<FakeFlyer>([&, server](const Trial& trial, const std::atomic<bool>&) -> Result<Flight> {
          ++flights_[server.profiles.parent_path().filename()];
          Flight flight = fly(server, trial);
          if (++flown >= limit) stop = true;
          return flight;
        });
      };
    };
    const auto space = space_of(tune_, sheet_of());
    EXPECT_TRUE(space.ok()) << space.error();
    return run_tune(tune_, *space, sheet_of(), request_, flyers, stop, [this](const TuneProgress& p) { last_ = p; });
  }
  std::string file(const std::string& name) const {
    const auto text = read_file(folder_.path() / name);
    EXPECT_TRUE(text.ok()) << text.error();
    return text.ok() ? *text : "";
  }

  struct Counts {
    std::atomic<int>& operator[](const fs::path& folder) {
      const std::lock_guard lock(mutex);
      return counts[folder.string()];
    }
    std::mutex mutex;
    std::map<std::string, std::atomic<int>> counts;
  };
  Folder folder_;
  Tune tune_;
  RunRequest request_;
  Counts flights_;
  TuneProgress last_;
};

TEST_F(TuneRunTest, FindsABetterProfileAndSaysSo) {
  tune_.budget.trials = 28 * 12 + 24;
  const TuneSummary summary = run("out");
  ASSERT_EQ(summary.error, "");
  EXPECT_EQ(summary.flown, 28u * 12 + 24) << "12 generations of 7 profiles, 2 speeds, 2 seeds; 6 fresh seeds of both";
  EXPECT_THAT(summary.text, HasSubstr("The found profile is better: it wins no less often, with more clearance"));
  const auto found = ProfileSheet::parse(file("out/generations/012/profiles/base.txt"));
  EXPECT_EQ(found->text(), "name: \"base\"\n" + std::string(kSheet).substr(std::string("name: \"lab\"\n").size()))
      << "the base flies each generation";
  const std::string profile = file("out/profiles/lab-tuned.txt");
  EXPECT_THAT(profile, HasSubstr("name: \"lab-tuned\"\n"));
  EXPECT_THAT(profile, HasSubstr(", was 0.08\n"));
  EXPECT_EQ(file("out/profiles/lab.txt"), kSheet);
  EXPECT_THAT(file("out/report.md"), HasSubstr("better"));
  EXPECT_TRUE(fs::exists(folder_.path() / "out/comparison-012/report/report.md"));
  EXPECT_TRUE(fs::exists(folder_.path() / "out/figures/progress.csv"));
  EXPECT_EQ(last_.done, last_.total);
  EXPECT_TRUE(last_.comparing);
}

TEST_F(TuneRunTest, AValueThatEndsAtItsBorderIsNamed) {
  tune_.fields[0].min = 0.9;  // 0.3 would be best
  tune_.budget.trials = 28 * 12 + 24;
  const TuneSummary summary = run("out");
  ASSERT_EQ(summary.error, "");
  EXPECT_THAT(summary.text, HasSubstr("At the border of its range, which may have been too narrow: temperature."));
}

TEST_F(TuneRunTest, StoppedAnywhereItGoesOnToTheSameResult) {
  ASSERT_EQ(run("whole").error, "");
  const std::string trace = file("whole/trace.csv"), profile = file("whole/profiles/lab-tuned.txt"),
                    table = file("whole/comparison.csv");
  int runs = 0;
  for (TuneSummary part = run("parts", 20);; part = run("parts", 20)) {
    ASSERT_EQ(part.error, "");
    ASSERT_LT(++runs, 100);
    if (!part.interrupted) break;
  }
  EXPECT_GE(runs, 4);
  EXPECT_EQ(file("parts/trace.csv"), trace);
  EXPECT_EQ(file("parts/profiles/lab-tuned.txt"), profile);
  EXPECT_EQ(file("parts/comparison.csv"), table);
}

TEST_F(TuneRunTest, WhatWasFlownIsNotFlownAgain) {
  ASSERT_EQ(run("out").error, "");
  const TuneSummary again = run("out");
  EXPECT_EQ(again.error, "");
  EXPECT_EQ(again.flown, 0u);
  EXPECT_THAT(again.text, HasSubstr("The found profile is"));
}

TEST_F(TuneRunTest, ALargerBudgetGoesOnFarther) {
  ASSERT_EQ(run("out").error, "");
  const std::string before = file("out/trace.csv");
  tune_.budget.trials = *tune_.budget.trials + 28;
  const TuneSummary more = run("out");
  EXPECT_EQ(more.flown, 28u + 24) << "a generation, and a comparison of its own";
  EXPECT_TRUE(file("out/trace.csv").starts_with(before));
  EXPECT_TRUE(fs::exists(folder_.path() / "out/comparison-004/trials.csv"));
}

TEST_F(TuneRunTest, AllOfAGenerationFliesTheSameSeedsAndTheNextOneOthers) {
  ASSERT_EQ(run("out").error, "");
  std::map<int, std::set<std::uint64_t>> seeds;
  for (int generation = 1; generation <= 3; ++generation) {
    const auto results = read_trials(folder_.path() / "out/generations" / ("00" + std::to_string(generation)));
    ASSERT_TRUE(results.ok()) << results.error();
    std::map<std::string, std::set<std::uint64_t>> by_cell;
    for (const TrialResult& result : *results) by_cell[result.cell].insert(result.seed);
    EXPECT_EQ(by_cell.size(), 7u);
    for (const auto& [cell, own] : by_cell) EXPECT_EQ(own, by_cell.begin()->second) << cell;
    seeds[generation] = by_cell.begin()->second;
  }
  EXPECT_EQ(seeds[1], (std::set<std::uint64_t>{1, 2}));
  EXPECT_EQ(seeds[2], (std::set<std::uint64_t>{3, 4}));
}

TEST_F(TuneRunTest, AnotherSearchInTheSameFolderIsRefused) {
  ASSERT_EQ(run("out").error, "");
  tune_.seed = 2;
  EXPECT_THAT(run("out").error, HasSubstr("another search was begun in this folder"));
}

TEST_F(TuneRunTest, ABudgetWithoutRoomIsRefusedBeforeAnythingFlies) {
  tune_.budget.trials = 51;
  EXPECT_THAT(run("out").error, HasSubstr("trials is 51, expected at least 52: 24 for the comparison and 28 for each "
                                          "generation"));
  EXPECT_FALSE(fs::exists(folder_.path() / "out"));
}

TEST_F(TuneRunTest, ACampaignOfAGenerationStandsByItself) {
  ASSERT_EQ(run("out").error, "");
  const auto campaign = load_campaign(folder_.path() / "out/generations/002/campaign.txt");
  ASSERT_TRUE(campaign.ok()) << campaign.error();
  EXPECT_EQ(campaign->cells.size(), 7u);
  EXPECT_EQ(campaign->cells.front().name, "a-base");
  EXPECT_EQ(campaign->cells.back().profile, "c06");
}

}  // namespace
}  // namespace gatefield::race
