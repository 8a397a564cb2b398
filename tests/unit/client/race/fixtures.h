#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <mutex>
#include <set>

#include "client/race/campaign.h"
#include "client/race/flyer.h"
#include "client/race/trial.h"

namespace gatefield::race {

/// A folder of the test's own, gone with it.
class Folder {
 public:
  Folder()
      : path_(std::filesystem::temp_directory_path() /
              ("gatefield-race-" + std::to_string(getpid()) + "-" + std::to_string(++count()))) {
    std::filesystem::remove_all(path_);
    std::filesystem::create_directories(path_);
  }
  ~Folder() { std::filesystem::remove_all(path_); }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;

  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path put(const std::string& name, const std::string& text) const {
    std::ofstream(path_ / name, std::ios::binary) << text;
    return path_ / name;
  }

 private:
  static int& count() {
    static int made = 0;
    return made;
  }
  std::filesystem::path path_;
};

inline Campaign campaign_of(const std::string& text) {
  const Folder folder;
  auto campaign = load_campaign(folder.put("campaign.txt", text));
  EXPECT_TRUE(campaign.ok()) << campaign.error();
  return campaign.ok() ? std::move(campaign).value() : Campaign{};
}

inline const char* const kTwoCells = R"(
title: "Two"
defaults { scenario: "circle" seeds { first: 5 last: 8 } laps: 1 }
cell { name: "a" speed_m_s: [6, 8] }
cell { name: "b" speed_m_s: 7 perturbation { position_m: 0.3 } }
)";

/// What a trial gives in these tests: won unless its seed is a multiple of three.
inline TrialResult result_of(const Trial& trial) {
  simulator::Report report;
  report.outcome = trial.seed % 3 == 0 ? simulator::Outcome::kMissedGate : simulator::Outcome::kFinished;
  report.sentence = trial.seed % 3 == 0 ? "missed gate 2, flew past \"beside\" it" : "finished: 4 of 4 gates";
  report.gates_total = 4;
  report.passes.resize(trial.seed % 3 == 0 ? 1 : 4);
  report.race_time_s = 5.0 + 0.125 * static_cast<double>(trial.seed);
  report.top_speed_m_s = trial.speed_m_s + 0.5;
  report.clearance_m = 0.125;
  report.samples.resize(2);
  report.samples[1].t_s = 0.04;
  report.samples[1].state.p_WB = {1.0, static_cast<double>(trial.seed), 1.5};
  report.end_state.p_WB = report.samples[1].state.p_WB;
  return to_result(trial, report);
}

/// Flies by result_of(), or as a test wants.
class FakeFlyer final : public Flyer {
 public:
  using Fly = std::function<Result<Flight>(const Trial&, const std::atomic<bool>&)>;
  explicit FakeFlyer(Fly fly = {}) : fly_(std::move(fly)) {}
  Result<Flight> fly(const Trial& trial, const std::atomic<bool>& cancel) override {
    if (fly_) return fly_(trial, cancel);
    return good(trial);
  }
  bool lost() override { return dead; }
  static Flight good(const Trial& trial) {
    Flight flight;
    flight.end = Flight::End::kFlown;
    flight.result = result_of(trial);
    return flight;
  }
  std::atomic<bool> dead{false};

 private:
  Fly fly_;
};

}  // namespace gatefield::race
