// gatefield-bridge: flies a vehicle behind a flight controller as a client of a planning server.

#include <CLI/CLI.hpp>
#include <atomic>
#include <csignal>
#include <cstdio>
#include <future>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>

#include "client/bridge/betaflight/vehicle.h"
#include "client/bridge/config/config.h"
#include "client/bridge/flight_log.h"
#include "client/bridge/mavlink/vehicle.h"
#include "client/bridge/px4/vehicle.h"
#include "client/bridge/sources/source.h"
#include "client/bridge/terminal.h"
#include "client/flight/clock.h"
#include "client/flight/loop.h"
#include "client/flight/supervision.h"
#include "common/base/logging.h"
#include "common/base/text.h"
#include "common/dds/environment.h"
#include "common/dds/program_log.h"
#include "common/dds/security_error.h"
#include "gatefield/sdk/client.h"

namespace gatefield::bridge {
namespace {

using namespace std::chrono_literals;

constexpr Stamp kDiscovery = 3s;  // until another program's topic is found

constexpr int kExitLanded = 0, kExitNotLanded = 1, kExitBadInput = 2, kExitNoServer = 3, kExitLinkLost = 4;

std::atomic<bool> stop_requested{false};
static_assert(std::atomic<bool>::is_always_lock_free, "a signal handler stores into it");

struct Arguments {
  Firmware firmware = Firmware::kMavlink;
  std::string config;
  bool check = false;
  bool check_motors = false;
  std::string log_level = "info";
};

void declare(CLI::App* app, Arguments* a) {
  app->description(
      "Flies a vehicle behind a flight controller: collective thrust and body rates from a gatefield-server, under a\n"
      "supervisor (docs/safety.md). Propellers off until everything was tried (docs/flight-controllers.md).\n");
  app->footer(
      "\nExamples\n"
      "  gatefield-bridge mavlink --config racer.txt --check    what is there, and what stands in the way\n"
      "  gatefield-bridge mavlink --config racer.txt            one flight; Ctrl-C lands\n"
      "  gatefield-bridge betaflight --config racer.txt --check-motors    order of motors and signs, propellers off\n"
      "  gatefield-bridge px4 --config racer.txt                the same with PX4 over its uXRCE-DDS agent\n"
      "\nExit code\n"
      "  0 landed, or never took off   1 killed, or somebody else flies it   2 bad input   3 no server, it refused, or "
      "no "
      "plan came\n"
      "  4 the link to the flight controller was lost\n");
  app->add_option("firmware", a->firmware, "betaflight, mavlink or px4")
      ->required()
      ->transform(CLI::CheckedTransformer(firmware_names(), CLI::ignore_case));
  app->add_option("--config", a->config, "The bridge's text file (docs/flight-controllers.md)")->required();
  app->add_flag("--check", a->check, "Look at configuration and flight controller, and fly nothing");
  app->add_flag("--check-motors", a->check_motors,
                "betaflight: with your hands and eyes, find a wrong order of motors or a wrong sign, and fly nothing");
  app->add_option("--log-level", a->log_level, "trace, debug, info, warn, error or off")
      ->check(CLI::IsMember({"trace", "debug", "info", "warn", "error", "off"}))
      ->capture_default_str();
}

int complain(const std::string& sentence, int code) {
  std::fprintf(stderr, "gatefield-bridge: %s\n", sentence.c_str());
  return code;
}

/// A vehicle, and what learns of its thrust.
struct Opened {
  std::unique_ptr<Vehicle> vehicle;
  flight::ThrustEstimate* thrust = nullptr;
};

template <typename Concrete>
Result<Opened> opened(Result<std::unique_ptr<Concrete>> vehicle) {
  if (!vehicle) return vehicle.failure();
  flight::ThrustEstimate* const thrust = &(*vehicle)->thrust();
  return Opened{std::move(vehicle).value(), thrust};
}

Result<Opened> open_vehicle(const BridgeConfig& config, const Clock& clock) {
  if (const auto* options = std::get_if<betaflight::Options>(&config.firmware))
    return opened(betaflight::open(*options, config.session.quadrotor, clock));
  if (const auto* px4 = std::get_if<Px4Config>(&config.firmware))
    return opened(Px4Vehicle::open(*px4, &stop_requested));
  return opened(MavlinkVehicle::open(std::get<MavlinkConfig>(config.firmware), &stop_requested));
}

/// Keeps up the talk with the flight controller and asks nothing of it.
void listen(Vehicle* vehicle, flight::LoopClock* clock, Stamp span) {
  for (Stamp now = clock->now(), end = now + span; now < end;
       now = clock->sleep_until(now + vehicle->actuator().period())) {
    vehicle->flight_controller().want(now, flight::Wanted::kReleased);
    // Who has no clock of its own talks when it is told what to do, released: nothing.
    if (vehicle->clock() == nullptr) vehicle->actuator().hold(now);
  }
}

/// Joins a session while the talk goes on. Empty: a person ended it.
std::optional<Result<std::unique_ptr<sdk::Client>>> connect(const sdk::Options& options, Vehicle* vehicle,
                                                            flight::LoopClock* clock) {
  auto attempt = std::async(std::launch::async, [&options] { return sdk::Client::connect(options, &stop_requested); });
  while (attempt.wait_for(0s) != std::future_status::ready) listen(vehicle, clock, 20ms);
  if (stop_requested) return std::nullopt;
  return attempt.get();
}

/// Those from elsewhere, where there are such.
flight::StateSource* states(Vehicle& vehicle, sources::Source* source) {
  return source != nullptr && source->states() != nullptr ? source->states() : vehicle.states();
}

void complain_of(const Vehicle& vehicle, const sources::Source* source) {
  for (const std::string& sentence : vehicle.complaints()) log::warn(sentence);
  if (source == nullptr) return;
  for (const std::string& sentence : source->complaints()) log::warn(sentence);
}

int exit_code(const flight::LoopStatistics& flown, const FlightLog& flight_log, flight::Phase phase) {
  if (flight_log.link_lost()) return complain("the link to the flight controller was lost", kExitLinkLost);
  if (flown.end == flight::End::kGivenUp) return complain("no plan came for too long", kExitNoServer);
  if (phase == flight::Phase::kKilled) return complain("the motors were stopped", kExitNotLanded);
  if (phase == flight::Phase::kYielded) return complain("somebody else flies the vehicle", kExitNotLanded);
  return kExitLanded;
}

int fly(const BridgeConfig& config, const Opened& opened, sources::Source* source, flight::LoopClock* clock) {
  Vehicle& vehicle = *opened.vehicle;
  auto joined = connect(config.session, &vehicle, clock);
  if (!joined) return kExitLanded;
  if (!*joined)
    return complain(joined->error(), dds::is_about_security(joined->failure()) ? kExitBadInput : kExitNoServer);
  const std::unique_ptr<sdk::Client> client = std::move(*joined).value();
  log::info("joined a session as " + config.session.vehicle);

  flight::Supervision supervision(config.safety, config.session.quadrotor, config.session.actuation,
                                  config.session.course, opened.thrust);
  flight::LoopStatistics flown;
  int code = kExitLanded;
  {
    FlightLog flight_log(config.safety, config.session.actuation, vehicle.actuator().period(), client.get());
    const flight::Ports ports{.states = states(vehicle, source),
                              .depth = source != nullptr ? source->depth() : nullptr,
                              .actuator = &vehicle.actuator(),
                              .observer = &flight_log,
                              .controller = &vehicle.flight_controller(),
                              .supervision = &supervision};
    flown = flight::run_loop(ports, client.get(), config.loop, clock, stop_requested);
    code = exit_code(flown, flight_log, supervision.directive().phase);
  }
  log::info("flown " + fixed(seconds(flown.flown), 1) + " s, without a plan " + fixed(seconds(flown.on_fallback), 1) +
            " s of it; " + text(flown.late_steps) + " of " + text(flown.steps) + " steps late, by at most " +
            fixed(1e3 * seconds(flown.worst_late), 1) + " ms");
  complain_of(vehicle, source);
  return code;
}

/// Null: no other program is listened to.
Result<std::unique_ptr<sources::Source>> open_source(const BridgeConfig& config, const Clock& clock) {
  if (!config.sources.states && !config.sources.depth) return std::unique_ptr<sources::Source>();
  return sources::Source::open(config.sources, config.session.camera, config.session.domain, config.session.vehicle,
                               clock, config.session.network);
}

int check_motors(const BridgeConfig& config, const betaflight::Options& options) {
  const flight::RealTimeClock clock;
  const auto source = open_source(config, clock);
  if (!source) return complain(source.error(), kExitBadInput);
  auto opened = betaflight::open_connection(options, clock);
  if (!opened) return complain(opened.error(), kExitBadInput);
  Terminal terminal(stop_requested);
  terminal.tell("Motors will turn. Take the propellers off, and type yes when they are.");
  std::optional<std::string> said;
  while (!terminal.leaves() && !(said = terminal.answer())) std::this_thread::sleep_for(20ms);
  if (said != "yes") return complain("the propellers are not off: nothing was tried", kExitBadInput);
  const auto faults = betaflight::check_on_the_ground(opened->connection.get(), opened->settings, clock, &terminal,
                                                      *source ? (*source)->states() : nullptr);
  if (!faults) return complain(faults.error(), kExitBadInput);
  for (const std::string& fault : *faults) log::warn(fault);
  if (!faults->empty()) return complain("do not fly before this is mended", kExitBadInput);
  log::info("accelerometer, gyro, attitude and motors are as they should be");
  return kExitLanded;
}

int run(const Arguments& a) {
  auto config = load_config(a.config, a.firmware, !a.check && !a.check_motors);
  if (!config) return complain(config.error(), kExitBadInput);
  for (const std::string& note : config->notes) log::warn(note);
  for (const std::string& sentence : dds::settle_environment(config->session.network)) log::warn(sentence);

  if (a.check_motors) {
    if (const auto* options = std::get_if<betaflight::Options>(&config->firmware))
      return check_motors(*config, *options);
    return complain("--check-motors is for betaflight; an autopilot has its own (a ground station's motor test)",
                    kExitBadInput);
  }

  flight::RealTimeClock real_time;
  const auto opened = open_vehicle(*config, real_time);
  if (!opened) return complain(opened.error(), stop_requested ? kExitLanded : kExitBadInput);
  Vehicle& vehicle = *opened->vehicle;
  flight::LoopClock* const clock = vehicle.clock() != nullptr ? vehicle.clock() : &real_time;
  auto opened_source = open_source(*config, real_time);
  if (!opened_source) return complain(opened_source.error(), kExitBadInput);
  const std::unique_ptr<sources::Source> source = std::move(opened_source).value();
  listen(&vehicle, clock, 1s);
  for (const Stamp end = clock->now() + kDiscovery;
       source && !source->heard() && clock->now() < end && !stop_requested;)
    listen(&vehicle, clock, 100ms);
  for (const std::string& line : vehicle.description()) log::info(line);
  if (source)
    for (const std::string& line : source->description()) log::info(line);
  complain_of(vehicle, source.get());
  if (a.check || stop_requested) return kExitLanded;
  return fly(*config, *opened, source.get(), clock);
}

}  // namespace
}  // namespace gatefield::bridge

int main(int argc, char** argv) {
  using namespace gatefield::bridge;
  struct sigaction action {};
  action.sa_handler = [](int) { stop_requested = true; };
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);

  Arguments arguments;
  CLI::App app;
  app.name("gatefield-bridge");
  declare(&app, &arguments);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kExitLanded : kExitBadInput;
  }
  gatefield::log::start("gatefield-bridge", arguments.log_level);
  gatefield::dds::log_library_lines();
  return run(arguments);
}
