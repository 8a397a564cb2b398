// gatefield-sim: flies one race in simulation as a client of a planning server.

#include <unistd.h>

#include <CLI/CLI.hpp>
#include <atomic>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <future>
#include <iostream>
#include <numbers>

#include "client/simulator/depth_picture.h"
#include "client/simulator/flight_picture.h"
#include "client/simulator/simulation.h"
#include "common/base/logging.h"
#include "common/config/locate.h"
#include "common/config/scenario.h"
#include "common/protocol/validate.h"
#include "gatefield/sdk/client.h"

namespace gatefield::simulator {
namespace {

constexpr int kExitWon = 0, kExitLost = 1, kExitBadInput = 2, kExitNoServer = 3;

std::atomic<bool> stop_requested{false};
static_assert(std::atomic<bool>::is_always_lock_free, "a signal handler stores into it");

struct Arguments {
  std::string scenario, course, vehicle;
  std::optional<std::uint64_t> seed, planner_seed;
  std::optional<double> position_noise_m, yaw_noise_deg, camera_rate_hz, time_limit_s;
  std::optional<int> laps;
  double speed_m_s = 0.0;
  std::string profile = "race";
  std::string name = "drone", server;
  std::uint32_t domain = 0;
  bool lockstep = false, real_time = false, depth_metres = false, quiet = false;
  double delay_ms = 0.0, jitter_ms = 0.0, loss = 0.0;
  double state_rate_hz = 200.0;
  double connect_timeout_s = 10.0;
  std::string csv, picture, depth_picture, frame_folder;
  std::string log_level = "warn";
};

void declare(CLI::App* app, Arguments* a) {
  app->description(
      "Flies one race in simulation: MuJoCo for the vehicle, Embree for its depth camera, and a referee that knows "
      "where the\n"
      "gates truly stand. Plans come from a gatefield-server over DDS.\n");
  app->footer(
      "\nExamples\n"
      "  gatefield-sim --scenario circle-0.3m --speed 7 --picture flight.png     one race at 7 m/s, with a picture\n"
      "  gatefield-sim --scenario circle-0.3m --seed 12                          the same race with other gates\n"
      "  gatefield-sim --scenario circle-yaw30 --realtime                        at the speed of the real world\n"
      "  gatefield-sim --course my/course.txt --vehicle my/drone.txt             files of your own "
      "(docs/courses-and-vehicles.md)\n"
      "\nExit code\n"
      "  0 the race is won, or a person ended it (Ctrl-C)   1 lost   2 bad input   3 no server, or it refused\n");

  app->add_option("--scenario", a->scenario, "Scenario: a file or a short name (default: circle-0.3m)")->group("Race");
  app->add_option("--course", a->course, "Course in place of the scenario's: a file or a short name")->group("Race");
  app->add_option("--vehicle", a->vehicle, "Vehicle in place of the scenario's: a file or a short name")->group("Race");
  app->add_option("--seed", a->seed, "Seed of the gates' displacement, the noise and the planner")->group("Race");
  app->add_option("--planner-seed", a->planner_seed, "Seed of the planner alone (default: --seed)")->group("Race");
  app->add_option("--laps", a->laps, "Laps in place of the course's")->check(CLI::Range(1, kMaxLaps))->group("Race");
  app->add_option("--speed", a->speed_m_s, "Soft speed limit in m/s (default: the profile's)")
      ->check(CLI::Range(0.5, 50.0))
      ->group("Race");
  app->add_option("--position-noise", a->position_noise_m,
                  "Displacement of the gates in metres, in place of the scenario's")
      ->group("Race");
  app->add_option("--yaw-noise", a->yaw_noise_deg, "Turn of the gates in degrees, in place of the scenario's")
      ->group("Race");
  app->add_option("--camera-rate", a->camera_rate_hz, "Depth frames per second, in place of the vehicle's")
      ->group("Race");
  app->add_option("--time-limit", a->time_limit_s, "Longest race in seconds, in place of the scenario's")
      ->check(CLI::Range(1.0, 86400.0))
      ->group("Race");

  app->add_option("--profile", a->profile, "Planner profile of the server")->capture_default_str()->group("Server");
  app->add_option("--name", a->name, "Name of the vehicle on the wire; one client per name")
      ->capture_default_str()
      ->group("Server");
  app->add_option("--server", a->server, "Name of the one server that may answer (default: whichever does first)")
      ->group("Server");
  app->add_option("--domain", a->domain, "DDS domain")
      ->check(CLI::Range(0, 232))
      ->capture_default_str()
      ->group("Server");
  app->add_option("--connect-timeout", a->connect_timeout_s, "How long to look for a server, in seconds")
      ->check(CLI::Range(0.1, 600.0))
      ->capture_default_str()
      ->group("Server");

  auto* lockstep = app->add_flag("--lockstep", a->lockstep,
                                 "Simulated time, as fast as the machine can; same seed, same race (default)");
  auto* real_time = app->add_flag("--realtime", a->real_time, "At the speed of the real world");
  lockstep->excludes(real_time)->group("Time");
  real_time->group("Time");
  app->add_option("--delay-ms", a->delay_ms, "Lockstep: plans take effect this much later, as over a slow link")
      ->check(CLI::Range(0.0, 1000.0))
      ->group("Time");
  app->add_option("--jitter-ms", a->jitter_ms, "Lockstep: and by up to this much more, uniform, message by message")
      ->check(CLI::Range(0.0, 1000.0))
      ->group("Time");
  app->add_option("--loss", a->loss, "Lockstep: share of messages that are lost, each way")
      ->check(CLI::Range(0.0, 0.9))
      ->group("Time");
  app->add_option("--state-rate", a->state_rate_hz, "Real time: states sent per second")
      ->check(CLI::Range(10.0, 1000.0))
      ->capture_default_str()
      ->group("Time");
  app->add_flag("--depth-metres", a->depth_metres, "Send depth as 32-bit metres (default: 16-bit millimetres)")
      ->group("Time");

  app->add_option("--csv", a->csv, "Write the run here, a line every 10 ms")->group("Output");
  app->add_option("--picture", a->picture, "Write a picture of the flight here (PNG)")->group("Output");
  app->add_option("--depth-picture", a->depth_picture, "Write a depth frame in colours here (PNG)")->group("Output");
  app->add_option("--save-frame", a->frame_folder, "Keep a raw depth frame and its pose in this folder")
      ->group("Output");
  app->add_flag("--quiet,-q", a->quiet, "No progress, no summary; the exit code tells")->group("Output");
  app->add_option("--log-level", a->log_level, "trace, debug, info, warn, error or off")
      ->check(CLI::IsMember({"trace", "debug", "info", "warn", "error", "off"}))
      ->capture_default_str()
      ->group("Output");
}

Result<config::Scenario> read_scenario(const Arguments& a) {
  const bool own_parts = !a.course.empty() && !a.vehicle.empty();
  std::optional<config::Scenario> scenario;
  if (!a.scenario.empty() || !own_parts) {
    const auto file = config::find_config("scenarios", a.scenario.empty() ? "circle-0.3m" : a.scenario);
    if (!file) return Error{file.error()};
    auto loaded = config::load_scenario(*file);
    if (!loaded) return loaded;
    scenario = std::move(loaded).value();
    if (a.scenario.empty() && !a.course.empty()) scenario->title.clear();
  } else {
    scenario.emplace();
  }
  if (!a.course.empty()) {
    const auto file = config::find_config("courses", a.course);
    if (!file) return Error{file.error()};
    auto track = config::load_track(*file);
    if (!track) return Error{track.error()};
    scenario->track = std::move(track).value();
    scenario->course_file = *file;
  }
  if (!a.vehicle.empty()) {
    const auto file = config::find_config("vehicles", a.vehicle);
    if (!file) return Error{file.error()};
    auto vehicle = config::load_vehicle(*file);
    if (!vehicle) return Error{vehicle.error()};
    scenario->vehicle = std::move(vehicle).value();
    scenario->vehicle_file = *file;
  }
  if (scenario->title.empty()) scenario->title = scenario->track.title;
  if (a.seed) scenario->seed = *a.seed;
  if (a.laps) scenario->track.course.laps = *a.laps;
  if (a.position_noise_m) {
    scenario->perturbation.position_m = *a.position_noise_m;
    scenario->perturbation.height_m = 0.5 * *a.position_noise_m;
  }
  if (a.yaw_noise_deg) scenario->perturbation.yaw_rad = *a.yaw_noise_deg * std::numbers::pi / 180.0;
  if (auto status = config::validate(scenario->perturbation); !status) return Error{"command line: " + status.error()};
  if (a.camera_rate_hz) scenario->vehicle.camera.rate_hz = *a.camera_rate_hz;
  if (auto status = validate(scenario->vehicle.camera); !status) return Error{"command line: " + status.error()};
  if (a.time_limit_s) scenario->time_limit = from_seconds(*a.time_limit_s);
  return std::move(*scenario);
}

/// A file that can't be written is better known before the race than after it.
Status check_outputs(const Arguments& a) {
  for (const std::string& name :
       {a.csv, a.picture, a.depth_picture, a.frame_folder.empty() ? "" : a.frame_folder + "/frame.txt"}) {
    if (name.empty()) continue;
    const std::filesystem::path folder = std::filesystem::absolute(name).parent_path();
    std::error_code failure;
    std::filesystem::create_directories(folder, failure);
    if (failure || access(folder.c_str(), W_OK) != 0)
      return Error{name + ": its folder can't be made or written to, expected a place that this user may write to"};
    if (std::filesystem::is_directory(name, failure)) return Error{name + ": is a folder, expected a file name"};
  }
  return {};
}

/// Connects, but gives way to an interrupt at once. Null and no error: interrupted.
Result<std::unique_ptr<sdk::Client>> connect(const sdk::Options& options) {
  auto attempt = std::async(std::launch::async, [&options] { return sdk::Client::connect(options); });
  while (attempt.wait_for(std::chrono::milliseconds(50)) != std::future_status::ready) {
    if (!stop_requested) continue;
    // Leave properly if that is quick; nobody may wait for a server that does not answer.
    if (attempt.wait_for(std::chrono::milliseconds(1200)) != std::future_status::ready) {
      std::fprintf(stderr, "gatefield-sim: interrupted before a server answered\n");
      std::_Exit(kExitWon);
    }
  }
  return attempt.get();
}

/// One line on a terminal that is written over and over; elsewhere one line per lap.
class ProgressLine {
 public:
  explicit ProgressLine(bool quiet) : quiet_(quiet), terminal_(isatty(STDERR_FILENO) == 1) {}
  ~ProgressLine() { clear(); }

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

std::string subtitle(const Arguments& a, const config::Scenario& scenario, const Report& report) {
  char text[256];
  std::snprintf(text, sizeof text,
                "seed %llu, profile %s, gates displaced %.2f m, turned %.0f deg; top speed %.2f m/s, mean %.2f m/s; %s",
                static_cast<unsigned long long>(scenario.seed), a.profile.c_str(), scenario.perturbation.position_m,
                scenario.perturbation.yaw_rad * 180.0 / std::numbers::pi, report.top_speed_m_s, report.mean_speed_m_s,
                report.timing == protocol::Timing::kLockstep ? "lockstep" : "real time");
  return text;
}

Status write_outputs(const Arguments& a, const config::Scenario& scenario, const Report& report) {
  if (!a.csv.empty())
    if (auto status = write_csv(a.csv, report); !status) return status;
  if (!a.picture.empty())
    if (auto status = write_flight_picture(a.picture, scenario, report, subtitle(a, scenario, report)); !status)
      return status;
  if (!report.snapshot) return {};
  const Snapshot& snapshot = *report.snapshot;
  if (!a.depth_picture.empty()) {
    char title[128];
    std::snprintf(title, sizeof title, "Depth as the planner gets it, gate %d ahead, %.2f s into the race",
                  snapshot.gate + 1, snapshot.t_s);
    if (auto status = write_depth_picture(a.depth_picture, snapshot, title); !status) return status;
  }
  if (!a.frame_folder.empty())
    return save_frame(a.frame_folder, snapshot,
                      config::perturbed_world(scenario.track, scenario.perturbation, scenario.seed));
  return {};
}

int run(const Arguments& a) {
  const auto scenario = read_scenario(a);
  if (!scenario) return complain(scenario.error(), kExitBadInput);
  for (const std::string& note : scenario->vehicle.notes) log::warn(note);
  Options options;
  options.timing = a.real_time ? protocol::Timing::kRealTime : protocol::Timing::kLockstep;
  options.link_delay = from_seconds(1e-3 * a.delay_ms);
  options.link_jitter = from_seconds(1e-3 * a.jitter_ms);
  options.link_loss = a.loss;
  options.state_rate_hz = a.state_rate_hz;
  options.depth_in_millimetres = !a.depth_metres;
  if (auto status = validate(options); !status) return complain(status.error(), kExitBadInput);
  if (auto status = protocol::validate_name("--name", a.name); !status) return complain(status.error(), kExitBadInput);
  if (auto status = check_outputs(a); !status) return complain(status.error(), kExitBadInput);

  sdk::Options link;
  link.domain = a.domain;
  link.vehicle = a.name;
  link.server = a.server;
  link.profile = a.profile;
  link.timing = options.timing;
  link.seed = a.planner_seed.value_or(scenario->seed);
  link.speed_limit_m_s = a.speed_m_s;
  link.quadrotor = scenario->vehicle.quadrotor;
  link.camera = scenario->vehicle.camera;
  link.course = scenario->track.course;
  link.connect_timeout = std::chrono::milliseconds(std::lround(1000 * a.connect_timeout_s));
  auto client = connect(link);
  if (!client) return complain(client.error(), stop_requested ? kExitWon : kExitNoServer);

  ProgressLine line(a.quiet);
  const auto report =
      fly(*scenario, options, client.value().get(), stop_requested, [&line](const Progress& p) { line.show(p); });
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
  return run(arguments);
}
