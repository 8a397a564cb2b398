// gatefield-baseline-server: the planning service of gatefield-server with other eyes, to see what the learned field is
// worth. For evaluation alone: it is built with the simulator and not installed.

#include <signal.h>

#include <CLI/CLI.hpp>
#include <iostream>
#include <string>

#include "common/base/clock.h"
#include "common/base/logging.h"
#include "common/config/locate.h"
#include "common/dds/server_endpoint.h"
#include "common/protocol/validate.h"
#include "server/app/data_files.h"
#include "server/app/dds_transport.h"
#include "server/app/trace.h"
#include "server/baseline/perception.h"
#include "server/kernels/backend.h"
#include "server/service/service.h"

namespace gatefield::baseline {
namespace {

constexpr int kBadInput = 2, kNotJoined = 3;  // as gatefield-server's

struct Arguments {
  std::string perception, scenario, profiles, model, isa = "auto", log_level = "info", name = "gatefield", trace;
  std::uint32_t domain = 0;
  int threads = 1, perception_threads = 1;
  bool trace_rollouts = false;
};

int fail(int code, const std::string& sentence) {
  std::cerr << "gatefield-baseline-server: " << sentence << "\n";
  return code;
}

int run(const Arguments& arguments) {
  log::start("gatefield-baseline-server", arguments.log_level);
  const auto backend = kernels::select_backend(arguments.isa);
  if (!backend) return fail(kBadInput, "--isa: " + backend.error());
  if (const Status status = protocol::validate_name("--name", arguments.name); !status)
    return fail(kBadInput, status.error());
  const auto kind = parse_kind(arguments.perception);
  if (!kind) return fail(kBadInput, "--perception: " + kind.error());
  const auto scenario = config::load_scenario(arguments.scenario);
  if (!scenario) return fail(kBadInput, scenario.error());
  std::filesystem::path profiles_folder = arguments.profiles;
  if (profiles_folder.empty()) {
    auto found = config::config_folder();
    if (!found) return fail(kBadInput, found.error());
    profiles_folder = *found / "profiles";
  }
  auto profiles = app::load_profiles(profiles_folder);
  if (!profiles) return fail(kBadInput, profiles.error());

  service::ServiceOptions options;
  options.name = arguments.name;
  options.max_vehicles = 1;
  options.control_threads = arguments.threads;
  options.perception_threads = arguments.perception_threads;
  options.isa = std::string((*backend)->name());
  options.model_hash = 1 + static_cast<std::uint64_t>(*kind);
  options.sight.takes_prior = *kind == Kind::kClassical;
  options.profiles = std::move(profiles).value();
  // Who trusts the course is not slowed down by what is never seen.
  if (*kind == Kind::kNone)
    for (auto& [name, profile] : options.profiles) profile.unseen_speed_factor = 1.0;

  service::Factories factories;
  factories.planner = [&arguments, &backend](const planner::Profile& profile, const protocol::SessionRequest& request) {
    return app::traced(planner::Planner::create(profile, request.quadrotor, request.course.waypoints[0].gate, kGuideConeAngle_rad,
                                                request.seed, {.backend = *backend}),
                       request, {arguments.trace, arguments.trace_rollouts});
  };
  factories.memory = [&](const protocol::SessionRequest& request) { return make_memory(*kind, request, *scenario); };
  factories.encoder = [&]() -> Result<std::unique_ptr<perception::DepthEncoder>> {
    return make_encoder(*kind, scenario->track.course);
  };

  sigset_t ending;  // taken by this thread alone; all others inherit the mask
  sigemptyset(&ending);
  sigaddset(&ending, SIGINT);
  sigaddset(&ending, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &ending, nullptr);

  const MonotonicClock clock;
  app::DdsTransport transport;
  service::Service service(options, factories, &clock, &transport);
  transport.attach(&service);
  auto endpoint = dds::ServerEndpoint::create(arguments.domain, arguments.name, &transport, {});
  if (!endpoint) return fail(kNotJoined, endpoint.error());
  transport.attach(endpoint.value().get());
  if (const Status status = service.start(); !status) return fail(kBadInput, status.error());
  log::warn("for evaluation alone: perception " + std::string(name(*kind)) + ", " + arguments.scenario);
  log::info("ready: server " + arguments.name + " in DDS domain " + std::to_string(arguments.domain));

  int signal = 0;
  sigwait(&ending, &signal);
  service.stop();
  endpoint.value().reset();
  return 0;
}

}  // namespace
}  // namespace gatefield::baseline

int main(int argc, char** argv) {
  gatefield::baseline::Arguments arguments;
  CLI::App app{"The planning service with other eyes than the learned field's, for evaluation alone (docs/racing.md).",
               "gatefield-baseline-server"};
  app.add_option("--perception", arguments.perception,
                 "NONE: gates are where the course says. TRUE_POSE: the true gates, once the depth camera shows them. "
                 "CLASSICAL: a detector in the depth image")
      ->required();
  app.add_option("--scenario", arguments.scenario, "What is flown: the true gates are drawn from it and the seed")
      ->required()
      ->type_name("FILE");
  app.add_option("--profiles", arguments.profiles, "Folder of planner profiles (default: the shipped)");
  app.add_option("--domain", arguments.domain, "DDS domain")->check(CLI::Range(0u, gatefield::dds::kMaxDomain));
  app.add_option("--name", arguments.name, "The server's name")->capture_default_str();
  app.add_option("--threads", arguments.threads, "Control threads")->check(CLI::Range(1, 256))->capture_default_str();
  app.add_option("--perception-threads", arguments.perception_threads, "Threads that look at depth frames")
      ->check(CLI::Range(1, 256))
      ->capture_default_str();
  app.add_option("--isa", arguments.isa, "Instruction set of the kernels")->capture_default_str();
  app.add_option("--log-level", arguments.log_level, "trace, debug, info, warn, error or off")->capture_default_str();
  app.add_option("--trace", arguments.trace, "Folder for what the planner believed at each step, a file a vehicle");
  app.add_flag("--trace-rollouts", arguments.trace_rollouts, "And some of its rollouts");
  CLI11_PARSE(app, argc, argv);
  try {
    return gatefield::baseline::run(arguments);
  } catch (const std::exception& error) {
    return gatefield::baseline::fail(1, std::string("ended by an error that nobody expected: ") + error.what());
  }
}
