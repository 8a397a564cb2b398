#include "client/race/runner.h"

#include <gmock/gmock.h>

#include <thread>

#include "tests/unit/client/race/fixtures.h"

namespace gatefield::race {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

class Runner : public testing::Test {
 protected:
  RunSummary run(const FlyerFactory& factory, const std::function<void(const RunProgress&)>& on_progress = {}) {
    return run_trials(
        trials_, options_, factory,
        [this](const Trial&, const Flight& flight) {
          const std::lock_guard lock(mutex_);
          results_.push_back(flight.result);
          return sink_status_;
        },
        stop_, on_progress);
  }
  static FlyerFactory flying(const FakeFlyer::Fly& fly) {
    return [fly](int) { return std::make_unique<FakeFlyer>(fly); };
  }

  Campaign campaign_ = campaign_of(kTwoCells);
  std::vector<Trial> trials_ = trials_of(campaign_);
  RunnerOptions options_;
  std::atomic<bool> stop_{false};
  std::mutex mutex_;
  std::vector<TrialResult> results_;
  Status sink_status_;
};

TEST_F(Runner, FliesEachTrialOnceOnAllWorkers) {
  options_.workers = 3;
  std::atomic<int> made{0};
  RunProgress last;
  const auto summary = run(
      [&made](int) {
        ++made;
        return std::make_unique<FakeFlyer>();
      },
      [&last](const RunProgress& p) { last = p; });
  EXPECT_EQ(made, 3);
  EXPECT_TRUE(summary.error.empty()) << summary.error;
  EXPECT_EQ(summary.flown, trials_.size());
  std::set<std::string> names;
  for (const auto& result : results_) names.insert(trial_name(result));
  EXPECT_EQ(names.size(), trials_.size());
  EXPECT_EQ(summary.won, trials_.size() - 3) << "seed 6 of each of three lines is lost";
  EXPECT_EQ(last.done, trials_.size());
  EXPECT_EQ(last.left_s, 0.0);
}

TEST_F(Runner, ATrialWhoseServerDiesIsFlownAgain) {
  std::map<std::string, int> attempts;
  const auto summary = run(flying([&](const Trial& trial, const std::atomic<bool>&) -> Result<Flight> {
    if (++attempts[trial.name()] == 1 && trial.seed == 7) return Flight{Flight::End::kLost, {}, {}, {}, "killed"};
    return FakeFlyer::good(trial);
  }));
  EXPECT_EQ(summary.flown, trials_.size());
  EXPECT_EQ(summary.lost_attempts, 3u);
  for (const auto& result : results_) {
    EXPECT_EQ(result.attempts, result.seed == 7 ? 2 : 1);
    EXPECT_NE(result.failure, Failure::kLostServer);
  }
}

TEST_F(Runner, ATrialThatNeverFindsAServerIsHandedOverAsSuchAndTheOthersAreFlown) {
  const auto summary = run(flying([](const Trial& trial, const std::atomic<bool>&) -> Result<Flight> {
    if (trial.seed == 7 && trial.cell->name == "b") return Flight{Flight::End::kLost, {}, {}, {}, "it, too, died"};
    return FakeFlyer::good(trial);
  }));
  EXPECT_TRUE(summary.error.empty());
  ASSERT_EQ(results_.size(), trials_.size());
  int lost = 0;
  for (const auto& result : results_)
    if (result.failure == Failure::kLostServer) {
      ++lost;
      EXPECT_THAT(result.sentence, HasSubstr("it, too, died"));
      EXPECT_EQ(result.attempts, 3);
      EXPECT_EQ(result.gates_total, 4);
    }
  EXPECT_EQ(lost, 1);
}

TEST_F(Runner, WhenNobodyFindsAServerTheRunEnds) {
  options_.max_lost_in_a_row = 2;
  const auto summary = run(flying([](const Trial&, const std::atomic<bool>&) -> Result<Flight> {
    return Flight{Flight::End::kLost, {}, {}, {}, "gone"};
  }));
  EXPECT_THAT(summary.error, HasSubstr("2 trials in a row"));
  EXPECT_THAT(summary.error, HasSubstr("gone"));
  EXPECT_TRUE(summary.no_server);
  EXPECT_EQ(results_.size(), 2u);
}

TEST_F(Runner, WhatNoOtherTrialWouldCureEndsTheRun) {
  options_.workers = 2;
  const auto summary =
      run(flying([](const Trial&, const std::atomic<bool>&) -> Result<Flight> { return Error{"profile is 'warp'"}; }));
  EXPECT_EQ(summary.error, "profile is 'warp'");
  EXPECT_FALSE(summary.no_server);
  EXPECT_TRUE(results_.empty());
}

TEST_F(Runner, AFullDiskEndsTheRun) {
  sink_status_ = Error{"no room"};
  EXPECT_EQ(run(flying({})).error, "no room");
}

TEST_F(Runner, AnInterruptDropsTheFlightsInProgressAndEndsSoon) {
  options_.workers = 2;
  const auto begin = std::chrono::steady_clock::now();
  std::thread person([this] {
    std::this_thread::sleep_for(100ms);
    stop_ = true;
  });
  const auto summary = run(flying([](const Trial&, const std::atomic<bool>& cancel) -> Result<Flight> {
    while (!cancel) std::this_thread::sleep_for(1ms);
    return Flight{Flight::End::kCancelled, {}, {}, {}, ""};
  }));
  person.join();
  EXPECT_TRUE(summary.interrupted);
  EXPECT_EQ(summary.flown, 0u);
  EXPECT_TRUE(results_.empty());
  EXPECT_LT(std::chrono::steady_clock::now() - begin, 5s);
}

TEST_F(Runner, AFlightThatTakesTooLongIsCancelledAndCounted) {
  options_.trial_limit = std::chrono::seconds(0);
  options_.attempts = 2;
  trials_.resize(1);
  const auto summary = run(flying([](const Trial&, const std::atomic<bool>& cancel) -> Result<Flight> {
    while (!cancel) std::this_thread::sleep_for(1ms);
    return Flight{Flight::End::kCancelled, {}, {}, {}, ""};
  }));
  EXPECT_EQ(summary.lost_attempts, 2u);
  ASSERT_EQ(results_.size(), 1u);
  EXPECT_THAT(results_[0].sentence, HasSubstr("longer than 0 s"));
}

TEST_F(Runner, AFlightWhoseServerDiedIsCancelled) {
  trials_.resize(1);
  const auto summary = run([](int) {
    auto flyer = std::make_unique<FakeFlyer>(
        [tries = 0](const Trial& trial, const std::atomic<bool>& cancel) mutable -> Result<Flight> {
          if (++tries > 1) return FakeFlyer::good(trial);
          while (!cancel) std::this_thread::sleep_for(1ms);
          return Flight{Flight::End::kLost, {}, {}, {}, "died"};
        });
    flyer->dead = true;
    return flyer;
  });
  EXPECT_EQ(summary.flown, 1u);
  EXPECT_EQ(results_[0].attempts, 2);
}

}  // namespace
}  // namespace gatefield::race
