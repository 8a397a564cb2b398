#include "client/race/tune_command.h"

#include <cmath>
#include <cstdio>
#include <memory>

#include "client/race/exit_code.h"
#include "client/race/tune/tune_run.h"
#include "common/base/progress_line.h"
#include "common/base/text.h"
#include "common/config/locate.h"

namespace gatefield::race {
namespace {

std::string words(const TuneProgress& p) {
  std::string out = p.comparing ? std::string("comparison")
                                : "generation " + std::to_string(p.generation) + " of " + std::to_string(p.generations);
  out += ", " + std::to_string(p.done) + " of " + std::to_string(p.total) + " flights";
  if (std::isfinite(p.best)) out += "; last generation: best " + fixed(p.best, 3) + ", base " + fixed(p.base, 3);
  return out;
}

}  // namespace

int tune(const Arguments& a, const std::atomic<bool>& stop) {
  const auto file = config::find_config("tunes", a.tune);
  if (!file) return complain(file.error());
  TuneOrder order;
  if (a.trials > 0) order.budget.trials = a.trials;
  if (a.minutes > 0) order.budget.minutes = a.minutes;
  order.evaluation_seeds = a.evaluation_seeds;
  const auto wanted = load_tune(*file, order);
  if (!wanted) return complain(wanted.error());
  const auto request = request_of(a);
  if (!request) return complain(request.error());
  const auto base = read_profile(request->server.program, request->server.profiles, wanted->base_profile);
  if (!base) return complain(base.error());
  const auto space = space_of(*wanted, *base);
  if (!space) return complain(space.failure().at(file->string()).message);
  std::printf("%s\n", plan_words(*wanted, *space).c_str());
  if (a.dry_run) {
    for (const Dimension& d : space->dimensions())
      std::printf("%s: %s, from %s to %s, %s\n", d.name.c_str(), base->find(d.name)->value.c_str(),
                  brief(d.min).c_str(), brief(d.max).c_str(), d.logarithmic ? "logarithmic" : "linear");
    return kExitDone;
  }

  TuneSummary summary;
  {
    ProgressLine line(wanted->title);
    const FlyersFor flyers = [](const ServerOptions& server) -> FlyerFactory {
      return [server](int worker) { return std::make_unique<ServerFlyer>(server, worker); };
    };
    summary = run_tune(*wanted, *space, *base, *request, flyers, stop,
                       [&line, complete = false](const TuneProgress& p) mutable {
                         if (complete) return;
                         complete = p.done == p.total;
                         line.show(static_cast<double>(p.done) / static_cast<double>(p.total),
                                   std::isfinite(p.left_s) ? p.left_s : 0.0, words(p));
                       });
  }
  if (!summary.error.empty()) return complain(summary.error, summary.no_server ? kExitNoServer : kExitBadInput);
  if (summary.interrupted) {
    std::printf("Interrupted after %zu flights of this run; the same command goes on.\n", summary.flown);
    return kExitInterrupted;
  }
  std::printf("%s\nFound:  %s\nReport: %s\n", summary.text.c_str(), summary.profile.c_str(), summary.report.c_str());
  return kExitDone;
}

}  // namespace gatefield::race
