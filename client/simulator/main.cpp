// gatefield-sim: flies one race in simulation as a client of a planning server.

#include <unistd.h>

#include <CLI/CLI.hpp>
#include <atomic>
#include <csignal>
#include <cstdio>
#include <string>

#include "client/simulator/arguments.h"
#include "client/simulator/outputs.h"
#include "client/simulator/simulation.h"
#include "common/base/logging.h"
#include "common/dds/environment.h"
#include "common/dds/program_log.h"
#include "common/dds/security_error.h"
#include "gatefield/sdk/client.h"

namespace gatefield::simulator {
namespace {

constexpr int kExitWon = 0, kExitLost = 1, kExitBadInput = 2, kExitNoServer = 3;

std::atomic<bool> stop_requested{false};
static_assert(std::atomic<bool>::is_always_lock_free, "a signal handler stores into it");

/// One line on a terminal that is written over and over; elsewhere one line per lap.
class LapLine {
 public:
  explicit LapLine(bool quiet) : quiet_(quiet), terminal_(isatty(STDERR_FILENO) == 1) {}
  ~LapLine() { clear(); }

  void show(const Progress& p) {
    if (quiet_) return;
    if (terminal_) {
      std::fprintf(stderr, "\r\033[Klap %d/%d   gate %d/%d   %6.2f s   %5.2f m/s", p.lap + 1, p.laps, p.gate + 1,
                   p.gates, p.race_time_s, p.speed_m_s);
      std::fflush(stderr);
      shown_ = true;
    } else if (p.lap != lap_) {
      lap_ = p.lap;
      std::fprintf(stderr, "gatefield-sim: lap %d of %d begins at %.2f s\n", p.lap + 1, p.laps, p.race_time_s);
    }
  }

  void clear() {
    if (shown_) std::fprintf(stderr, "\r\033[K");
    shown_ = false;
  }

 private:
  bool quiet_, terminal_;
  bool shown_ = false;
  int lap_ = -1;
};

int complain(const std::string& sentence, int code) {
  std::fprintf(stderr, "gatefield-sim: %s\n", sentence.c_str());
  return code;
}

int run(const Arguments& a) {
  const auto scenario = read_scenario(a);
  if (!scenario) return complain(scenario.error(), kExitBadInput);
  for (const std::string& note : scenario->vehicle.notes) log::warn(note);
  const Options options = race_options(a);
  if (auto status = validate(options); !status) return complain(status.error(), kExitBadInput);
  const auto link = link_options(a, *scenario);
  if (!link) return complain(link.error(), kExitBadInput);
  if (auto status = check_outputs(a); !status) return complain(status.error(), kExitBadInput);
  auto client = sdk::Client::connect(*link, &stop_requested);
  if (!client && dds::is_about_security(client.failure())) return complain(client.error(), kExitBadInput);
  if (!client) return complain(client.error(), stop_requested ? kExitWon : kExitNoServer);

  LapLine line(a.quiet);
  const auto report = fly(
      *scenario, options, client.value().get(), stop_requested, [&line](const Progress& p) { line.show(p); },
      [&line](const HeardProblem& heard) {
        line.clear();
        log::warn("the server says, " + in_words(heard));
      },
      [&line](const HeardSession& heard) {
        line.clear();
        log::warn(in_words(heard));
      });
  client.value().reset();  // leaves the session before anything slow is done
  line.clear();
  if (!report) return complain(report.error(), kExitBadInput);

  if (!a.quiet) std::fputs(summarize(*report).c_str(), stdout);
  if (auto status = write_outputs(a, *scenario, *report); !status) return complain(status.error(), kExitBadInput);
  return report->outcome == Outcome::kFinished || report->outcome == Outcome::kInterrupted ? kExitWon : kExitLost;
}

}  // namespace
}  // namespace gatefield::simulator

int main(int argc, char** argv) {
  using namespace gatefield::simulator;
  struct sigaction action {};
  action.sa_handler = [](int) { stop_requested = true; };
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);

  Arguments arguments;
  CLI::App app;
  app.name("gatefield-sim");
  declare(&app, &arguments);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kExitWon : kExitBadInput;
  }
  gatefield::log::start("gatefield-sim", arguments.log_level);
  gatefield::dds::log_library_lines();
  for (const std::string& sentence : gatefield::dds::settle_environment(arguments.network))
    gatefield::log::warn(sentence);
  return run(arguments);
}
