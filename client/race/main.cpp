// gatefield-race: flies campaigns of seeded races and reports what share of them was won.

#include <atomic>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>

#include "client/race/campaign_run.h"
#include "client/race/exit_code.h"
#include "client/race/options.h"
#include "client/race/report.h"
#include "client/race/tune_command.h"
#include "common/base/logging.h"
#include "common/base/progress_line.h"
#include "common/dds/environment.h"

namespace gatefield::race {
namespace {

namespace fs = std::filesystem;

std::atomic<bool> stop_requested{false};
static_assert(std::atomic<bool>::is_always_lock_free, "a signal handler stores into it");

/// The second Ctrl-C does not wait; our servers end with us.
void on_signal(int) {
  if (stop_requested.exchange(true)) std::_Exit(kExitInterrupted);
}

void print_plan(const Campaign& campaign, const RunRequest& request, const Plan& plan) {
  std::printf("%s: %zu trials to fly, %zu done, on %d workers, into %s\n", campaign.title.c_str(), plan.trials.size(),
              plan.done, request.runner.workers, request.folder.c_str());
}

int report(const fs::path& folder) {
  const auto files = write_report(folder);
  if (!files) return complain(files.error());
  std::fputs(files->text.c_str(), stdout);
  for (const std::string& remark : files->remarks) std::printf("Note: %s\n", remark.c_str());
  std::printf("Report: %s\n", (files->folder / "report.md").c_str());
  return kExitDone;
}

int run(const Arguments& a) {
  const auto campaign = campaign_of(a);
  if (!campaign) return complain(campaign.error());
  const auto request = request_of(a);
  if (!request) return complain(request.error());
  const auto plan = plan_run(*campaign, *request);
  if (!plan) return complain(plan.error());
  for (const std::string& note : campaign->notes) std::fprintf(stderr, "gatefield-race: note: %s\n", note.c_str());
  print_plan(*campaign, *request, *plan);
  if (a.dry_run) {
    for (const Trial& trial : plan->trials) std::printf("%s\n", trial.name().c_str());
    return kExitDone;
  }

  RunSummary summary;
  {
    ProgressLine line(campaign->title);
    const auto show = [&line, complete = false](const RunProgress& p) mutable {
      if (complete) return;
      complete = p.done == p.total;
      std::string rest =
          std::to_string(p.done) + " of " + std::to_string(p.total) + ", " + std::to_string(p.won) + " won";
      if (p.lost_attempts > 0) rest += ", server lost " + std::to_string(p.lost_attempts) + " times";
      line.show(p.total > 0 ? static_cast<double>(p.done) / static_cast<double>(p.total) : 1.0,
                std::isfinite(p.left_s) ? p.left_s : 0.0, rest);
    };
    const FlyerFactory factory = [&request](int worker) {
      return std::make_unique<ServerFlyer>(request->server, worker);
    };
    summary = run_campaign(*campaign, *request, *plan, factory, stop_requested, show);
  }
  if (!summary.error.empty())
    complain(summary.error, kExitBadInput);
  else
    std::printf("%zu trials flown in this run, %zu of them won%s\n", summary.flown, summary.won,
                summary.lost_attempts > 0
                    ? (", the server was lost " + std::to_string(summary.lost_attempts) + " times").c_str()
                    : "");
  if (summary.interrupted || !summary.error.empty()) {
    std::printf("%zu trials are left; the same command goes on with them.\n", plan->trials.size() - summary.flown);
    if (summary.interrupted) return kExitInterrupted;
    return summary.no_server ? kExitNoServer : kExitBadInput;
  }
  return a.no_report ? kExitDone : report(request->folder);
}

int merge(const Arguments& a) {
  std::vector<fs::path> sources(a.sources.begin(), a.sources.end());
  const auto count = merge_results(sources, a.out, a.allow_mixed);
  if (!count) return complain(count.error());
  std::printf("%zu trials in %s\n", *count, (fs::path(a.out) / "trials.csv").c_str());
  return a.no_report ? kExitDone : report(a.out);
}

}  // namespace
}  // namespace gatefield::race

int main(int argc, char** argv) {
  using namespace gatefield::race;
  struct sigaction action {};
  action.sa_handler = on_signal;
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);

  Arguments arguments;
  CLI::App app;
  app.name("gatefield-race");
  declare(&app, &arguments);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kExitDone : kExitBadInput;
  }
  gatefield::log::start("gatefield-race", "warn");
  if (app.got_subcommand("merge")) return merge(arguments);
  if (app.got_subcommand("report")) return report(arguments.out);
  for (const std::string& sentence : gatefield::dds::settle_environment(arguments.network))
    gatefield::log::warn(sentence);
  if (app.got_subcommand("paper")) {
    arguments.campaign = "paper";
    if (arguments.out.empty()) arguments.out = "out/paper";
  }
  if (app.got_subcommand("tune")) return tune(arguments, stop_requested);
  return run(arguments);
}
