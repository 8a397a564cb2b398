#pragma once

#include <atomic>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "client/race/campaign.h"
#include "client/race/flyer.h"
#include "client/race/runner.h"
#include "client/race/trial.h"

namespace gatefield::race {

struct RunRequest {
  std::filesystem::path folder;  ///< of the results
  Selection selection;
  std::optional<std::size_t> limit;  ///< at most so many trials in this run
  bool allow_mixed = false;          ///< go on although programs, profile or model have changed
  int paths = 10;                    ///< flights of each cell and speed whose path is kept; lost ones always are
  int pictures = 3;                  ///< lost flights of each cell and speed that are drawn
  RunnerOptions runner;
  ServerOptions server;

  /// The folder of the results, and within it all that servers of our own read and write.
  void set_folder(const std::filesystem::path& results);
};

/// What a run has to do.
struct Plan {
  std::vector<Trial> trials;                    ///< that are not done yet
  std::size_t done = 0;                         ///< of the selection, in the folder already
  std::map<std::string, std::uint64_t> setups;  ///< by cell
};

/// Fingerprint of all that decides how a trial of the cell flies but speed and seed: scenario, course, vehicle, laps,
/// link, a planner's seed that is said; and for servers of our own the profile, the model, the instruction set asked
/// for and the programs themselves. Errors: a profile or model that isn't there.
Result<std::uint64_t> setup_of(const Cell& cell, const ServerOptions& server,
                               const std::optional<std::uint64_t>& planner_seed = {});

/// Finds what is in the folder already and what remains to be flown. Results of another setup are refused (or, with
/// allow_mixed, counted).
/// Errors: the folder's files, or a changed setup, with what to do.
Result<Plan> plan_run(const Campaign& campaign, const RunRequest& request);

/// Flies what the plan says and writes, trial by trial, trials*.csv, paths/ and failures/ in the folder, beside the
/// campaign itself (save_campaign). A trial's other files are there before its line is.
/// Errors: as RunSummary::error; files that can't be written.
RunSummary run_campaign(const Campaign& campaign, const RunRequest& request, const Plan& plan,
                        const FlyerFactory& factory, const std::atomic<bool>& stop,
                        const std::function<void(const RunProgress&)>& on_progress = {});

/// Puts the results of several folders (or trials*.csv files) into one: all their trials as <out>/trials.csv, with
/// campaign, cells, paths and failures. Errors: results of one cell that differ in setup, unless allow_mixed; files.
/// @return the number of trials
Result<std::size_t> merge_results(const std::vector<std::filesystem::path>& sources, const std::filesystem::path& out,
                                  bool allow_mixed);

}  // namespace gatefield::race
