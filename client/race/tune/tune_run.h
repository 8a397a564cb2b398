#pragma once

#include <atomic>
#include <functional>
#include <string>

#include "client/race/campaign_run.h"
#include "client/race/tune/search.h"
#include "client/race/tune/tune.h"

namespace gatefield::race {

/// How a search stands, for a progress line.
struct TuneProgress {
  std::size_t generation = 0, generations = 0;  ///< the one that is flown, from 1; how many the budget has room for
  bool comparing = false;                       ///< the search is over, the comparison is flown
  std::size_t done = 0, total = 0;              ///< trials, with those of earlier runs
  double left_s = 0.0;                          ///< NaN: not known
  double best = 0.0, base = 0.0;                ///< scores of the generation before; NaN: none
};

struct TuneSummary {
  std::size_t flown = 0;  ///< trials of this run
  bool interrupted = false;
  std::string error;  ///< why it ended early; empty: it did not, or a person ended it
  bool no_server = false;
  std::string text;               ///< the comparison and its verdict, for a terminal
  std::filesystem::path profile;  ///< what was found, for gatefield-server --profiles
  std::filesystem::path report;
};

/// Makes the flyers of one campaign's workers, with the servers that they shall start.
using FlyersFor = std::function<FlyerFactory(const ServerOptions&)>;

/// Searches, compares, reports; what earlier runs flew into the folder is taken from there, so that a run that was
/// ended at any point goes on where it was, and gives the same in the end.
/// In request.folder: search.txt (what is looked for, so that nothing else is gone on with), generations/<number>
/// (campaigns, with the candidates' profiles), trace.csv and figures/, profiles/ (the base, complete, and what was
/// found), comparison-<generations> (a campaign with its report), report.md.
/// @param base  of tune.base_profile, as the server has it
/// Errors: as TuneSummary::error. A budget without room for one generation and the comparison is one.
TuneSummary run_tune(const Tune& tune, const Space& space, const ProfileSheet& base, const RunRequest& request,
                     const FlyersFor& flyers, const std::atomic<bool>& stop,
                     const std::function<void(const TuneProgress&)>& on_progress = {});

/// What the budget will be spent on, for people; says so when minutes decide.
std::string plan_words(const Tune& tune, const Space& space);

}  // namespace gatefield::race
