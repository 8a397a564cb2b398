#include "client/race/tune/tune_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

#include "client/race/files.h"
#include "client/race/trial_log.h"
#include "client/race/tune/comparison.h"
#include "client/race/tune/trace.h"
#include "client/race/tune/tune_report.h"

namespace gatefield::race {
namespace {

namespace fs = std::filesystem;

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

Costs costs_of(const Tune& tune, const Space& space) {
  const std::size_t races = tune.races_per_seed();
  const auto profiles = static_cast<std::size_t>(candidates_of(tune, space)) + 1;
  return {profiles * races * tune.seeds_per_generation, 2 * races * tune.fresh_seeds.count(), std::nullopt};
}

/// All that decides a search but the races, which campaigns hold against what was flown, and the budget.
std::string search_text(const Tune& tune, const Space& space, const ProfileSheet& base) {
  std::string out = fmt::format("candidates {}, seeds per generation {}, spread {}, seed {}\n",
                                candidates_of(tune, space), tune.seeds_per_generation, tune.spread, tune.seed);
  for (const Cell& cell : tune.races.cells)
    out += fmt::format("races {} seeds {} to {} speeds {}\n", cell.name, cell.seeds.first, cell.seeds.last,
                       fmt::join(cell.speeds_m_s, " "));
  for (const Dimension& d : space.dimensions())
    out += fmt::format("field {} {} to {} {}\n", d.name, d.min, d.max, d.logarithmic ? "logarithmic" : "linear");
  return out + "\n" + base.text();
}

/// The cell as a profile flies it in a search or a comparison: nothing that reports show of others.
Cell flown_by(const Cell& cell, const std::string& ending, const std::string& profile, const SeedRange& seeds) {
  Cell out = cell;
  out.name = cell.name + ending;
  out.title = cell.title + ", " + profile;
  out.series = cell.title;
  out.profile = profile;
  out.seeds = seeds;
  out.beside.clear();
  out.goal.reset();
  out.published.clear();
  out.rollouts = false;
  // The scenario names its course, vehicle and noise after the cell.
  const auto rename = [&out, &cell](const std::string& part) {
    const std::string before = "\"" + cell.name + part, after = "\"" + out.name + part;
    for (std::size_t at = out.scenario_text.find(before); at != std::string::npos;
         at = out.scenario_text.find(before, at + after.size()))
      out.scenario_text.replace(at, before.size(), after);
  };
  for (const char* part : {".course.txt\"", ".vehicle.txt\"", ".noise.txt\""}) rename(part);
  return out;
}

/// The next seeds of a cell's range, then again from its begin: every candidate of a generation has the same.
SeedRange seeds_of(const Cell& cell, std::uint64_t count, std::size_t generation) {
  const std::uint64_t first = cell.seeds.first + (generation - 1) % (cell.seeds.count() / count) * count;
  return {first, first + count - 1};
}

class TuneRun {
 public:
  TuneRun(const Tune& tune, const Space& space, const ProfileSheet& base, const RunRequest& request,
          const FlyersFor& flyers, const std::atomic<bool>& stop,
          const std::function<void(const TuneProgress&)>& on_progress)
      : tune_(tune),
        space_(space),
        base_(base),
        request_(request),
        flyers_(flyers),
        stop_(stop),
        on_progress_(on_progress),
        search_(tune, space),
        costs_(costs_of(tune, space)) {}

  TuneSummary go() {
    if (begin() && search()) compare();
    return std::move(summary_);
  }

 private:
  bool fail(const std::string& why) {
    summary_.error = why;
    return false;
  }
  std::nullopt_t none(const std::string& why) {
    fail(why);
    return std::nullopt;
  }
  bool keep(const fs::path& file, const std::string& content) {
    const auto status = put_file(file, content);
    return status.ok() || fail(status.error());
  }

  bool begin() {
    if (generations_within(tune_.budget, costs_) == 0)
      return fail(fmt::format("trials is {}, expected at least {}: {} for the comparison and {} for each generation",
                              *tune_.budget.trials, costs_.comparison + costs_.generation, costs_.comparison,
                              costs_.generation));
    const fs::path file = request_.folder / "search.txt";
    const std::string text = search_text(tune_, space_, base_);
    std::error_code failure;
    if (fs::exists(file, failure)) {
      const auto there = read_file(file);
      if (!there) return fail(there.error());
      if (*there != text)
        return fail(
            file.string() +
            ": another search was begun in this folder (fields, seeds, candidates or base differ), expected the "
            "same one, or another --out");
    }
    return keep(file, text);
  }

  bool search() {
    for (std::size_t number = 1; number <= generations_within(tune_.budget, costs_); ++number) {
      const std::vector<ProfileSheet> profiles = search_.next();
      const fs::path folder = request_.folder / "generations" / fmt::format("{:03}", number);
      Campaign campaign;
      campaign.title = fmt::format("{}, generation {}", tune_.title, number);
      for (const ProfileSheet& profile : profiles) {
        if (!keep(folder / "profiles" / (profile.name() + ".txt"), profile.text())) return false;
        for (const Cell& cell : tune_.races.cells)
          campaign.cells.push_back(
              flown_by(cell, "-" + profile.name(), profile.name(), seeds_of(cell, tune_.seeds_per_generation, number)));
      }
      const auto results = fly(campaign, folder, folder / "profiles");
      if (!results) return false;
      std::vector<Score> scores;
      for (const ProfileSheet& profile : profiles) {
        std::vector<TrialResult> own;
        for (const TrialResult& result : *results)
          if (result.profile == profile.name()) own.push_back(result);
        scores.push_back(summarize_scores(campaign, own));
      }
      search_.take(scores);
      if (!write_trace()) return false;
    }
    return true;
  }

  bool write_trace() {
    if (!keep(request_.folder / "trace.csv", trace_csv(space_, search_.generations()))) return false;
    const auto drawn =
        plot::draw(trace_chart(tune_.title, search_.generations()), request_.folder / "figures", "progress");
    if (!drawn) return fail(drawn.error());
    return true;
  }

  void compare() {
    comparing_ = true;
    ProfileSheet found = space_.profile(search_.found());
    found.rename(base_.name().substr(0, 57) + "-tuned");
    const fs::path profiles = request_.folder / "profiles";
    summary_.profile = profiles / (found.name() + ".txt");
    if (!keep(profiles / (base_.name() + ".txt"), base_.text()) ||
        !keep(summary_.profile, found_text(tune_, search_.generations().size(), base_, found)))
      return;
    Campaign campaign;
    campaign.title = tune_.title + ": the base and what was found, on fresh seeds";
    for (const Cell& cell : tune_.races.cells) {
      campaign.cells.push_back(flown_by(cell, kBaseEnding, base_.name(), tune_.fresh_seeds));
      campaign.cells.push_back(flown_by(cell, kFoundEnding, found.name(), tune_.fresh_seeds));
    }
    const fs::path folder = request_.folder / fmt::format("comparison-{:03}", search_.generations().size());
    const auto results = fly(campaign, folder, profiles);
    if (!results) return;
    const auto report = write_tune_report(tune_, space_, search_, campaign, *results, request_.folder, folder, found);
    if (!report) {
      fail(report.error());
      return;
    }
    summary_.text = report->text;
    summary_.report = report->page;
  }

  /// All of the campaign's results; what is missing is flown. None: the summary says why.
  std::optional<std::vector<TrialResult>> fly(const Campaign& campaign, const fs::path& folder,
                                              const fs::path& profiles) {
    RunRequest request = request_;
    request.set_folder(folder);
    request.server.profiles = profiles;
    if (!comparing_) request.paths = request.pictures = 0;
    const auto plan = plan_run(campaign, request);
    if (!plan) return none(plan.error());
    if (!plan->trials.empty()) {
      const RunSummary flown = run_campaign(campaign, request, *plan, flyers_(request.server), stop_,
                                            [&](const RunProgress& p) { tell(plan->done + p.done, p); });
      summary_.flown += flown.flown;
      flown_before_s_ += flown_s_;
      flown_s_ = 0.0;
      summary_.interrupted = flown.interrupted;
      summary_.no_server = flown.no_server;
      if (!flown.error.empty()) return none(flown.error);
      if (flown.interrupted) return std::nullopt;
    }
    // From the log also what was flown a moment ago, so that it is the same whether this run flew it or an earlier one.
    auto results = read_trials(folder);
    if (!results) return none(results.error());
    // Sums depend on the order, and the log's is that of landing.
    std::sort(results.value().begin(), results.value().end(), [](const TrialResult& a, const TrialResult& b) {
      return std::tie(a.cell, a.speed_m_s, a.seed) < std::tie(b.cell, b.speed_m_s, b.seed);
    });
    for (const TrialResult& result : *results) {
      wall_s_ += result.wall_s;
      if (result.failure != Failure::kLostServer) continue;
      summary_.no_server = true;
      return none(trial_name(result) + " found no server that answers; the same command flies it again");
    }
    done_ += results->size();
    costs_.per_trial_s = wall_s_ / static_cast<double>(std::max<std::size_t>(done_, 1)) / request_.runner.workers;
    return std::move(results).value();
  }

  void tell(std::size_t done_here, const RunProgress& p) {
    flown_s_ = p.elapsed_s;
    if (!on_progress_) return;
    TuneProgress out;
    const std::vector<Generation>& generations = search_.generations();
    out.generations = comparing_ ? generations.size() : generations_within(tune_.budget, costs_);
    out.generation = std::min(out.generations, generations.size() + 1);
    out.comparing = comparing_;
    out.done = done_ + done_here;
    out.total = std::max(out.done, out.generations * costs_.generation + costs_.comparison);
    out.best = out.base = kUnknown;
    if (!generations.empty()) {
      out.base = generations.back().base.mean;
      for (const Candidate& candidate : generations.back().candidates)
        if (!(candidate.score.mean <= out.best)) out.best = candidate.score.mean;
    }
    const std::size_t flown = summary_.flown + p.done;
    out.left_s = flown == 0 ? kUnknown
                            : (flown_before_s_ + flown_s_) / static_cast<double>(flown) *
                                  static_cast<double>(out.total - out.done);
    on_progress_(out);
  }

  const Tune& tune_;
  const Space& space_;
  const ProfileSheet& base_;
  const RunRequest& request_;
  const FlyersFor& flyers_;
  const std::atomic<bool>& stop_;
  const std::function<void(const TuneProgress&)>& on_progress_;
  Search search_;
  Costs costs_;
  TuneSummary summary_;
  bool comparing_ = false;
  std::size_t done_ = 0;                         ///< trials of generations that are whole
  double wall_s_ = 0.0;                          ///< of those, as flown
  double flown_before_s_ = 0.0, flown_s_ = 0.0;  ///< in this run: campaigns before the one that is flown, and that one
};

}  // namespace

TuneSummary run_tune(const Tune& tune, const Space& space, const ProfileSheet& base, const RunRequest& request,
                     const FlyersFor& flyers, const std::atomic<bool>& stop,
                     const std::function<void(const TuneProgress&)>& on_progress) {
  return TuneRun(tune, space, base, request, flyers, stop, on_progress).go();
}

std::string plan_words(const Tune& tune, const Space& space) {
  const Costs costs = costs_of(tune, space);
  std::string out = fmt::format(
      "{}: {} fields of profile {}, {} candidates and the base a generation, {} trials each; "
      "{} trials for the comparison; ",
      tune.title, space.size(), tune.base_profile, candidates_of(tune, space),
      tune.races_per_seed() * tune.seeds_per_generation, costs.comparison);
  if (tune.budget.minutes)
    return out + fmt::format("as many generations as {} minutes have room for", *tune.budget.minutes);
  return out + fmt::format("{} generations", generations_within(tune.budget, costs));
}

}  // namespace gatefield::race
