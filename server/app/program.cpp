#include "server/app/program.h"

#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <atomic>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <functional>
#include <iostream>
#include <thread>
#include <utility>

#include "common/base/clock.h"
#include "common/base/logging.h"
#include "common/base/text.h"
#include "common/config/locate.h"
#include "common/dds/discovery_server.h"
#include "common/dds/environment.h"
#include "common/dds/network_arguments.h"
#include "common/dds/program_log.h"
#include "common/dds/security_error.h"
#include "common/dds/server_endpoint.h"
#include "common/protocol/validate.h"
#include "server/app/data_files.h"
#include "server/app/dds_transport.h"
#include "server/app/signals.h"
#include "server/app/watch.h"
#include "server/kernels/backend.h"
#include "server/kernels/crew.h"
#include "server/planner/planner.h"
#include "server/planner/profile_file.h"
#include "server/service/service.h"
#include "server/service/trial.h"

namespace gatefield::app {
namespace {

int fail(const std::string& program, int code, const std::string& sentence) {
  std::cerr << program << ": " << sentence << "\n";
  return code;
}

/// Keeps the pages in memory, when that can't later make an allocation fail. @return why not; empty when done
std::string lock_memory() {
  rlimit limit{};
  getrlimit(RLIMIT_MEMLOCK, &limit);
  if (limit.rlim_cur != RLIM_INFINITY && geteuid() != 0)
    return "memory was not locked: the memlock limit is " + std::to_string(limit.rlim_cur) +
           " bytes, expected unlimited (ulimit -l, LimitMEMLOCK=)";
  if (mlockall(MCL_CURRENT | MCL_FUTURE) != 0)
    return std::string("memory was not locked (") + std::strerror(errno) + "), expected CAP_IPC_LOCK";
  return {};
}

Result<std::filesystem::path> profiles_folder(const Options& options) {
  if (!options.profiles.empty()) return std::filesystem::path(options.profiles);
  auto found = config::config_folder();
  if (!found) return found.failure();
  return *found / "profiles";
}

/// What lies in the folder, as these eyes can fly by it.
Result<service::Profiles> profiles_for(const Eyes& eyes, const std::filesystem::path& folder) {
  auto profiles = load_profiles(folder);
  if (profiles && eyes.blind)
    for (auto& [name, profile] : profiles.value()) profile.unseen_speed_factor = 1.0;
  return profiles;
}

std::string names_of(const service::Profiles& profiles) {
  std::string names;
  for (const auto& [name, profile] : profiles) names += (names.empty() ? "" : ", ") + name;
  return names;
}

service::Factories factories(const Options& options, const Eyes& eyes, const planner::PlannerOptions& planning) {
  service::Factories made;
  made.planner = [cone_angle_rad = eyes.cone_angle_rad, planning](const planner::Profile& profile,
                                                                  const protocol::SessionRequest& request) {
    planner::PlannerOptions vehicles = planning;
    vehicles.actuation = request.actuation;
    return planner::Planner::create(profile, request.quadrotor, request.course, cone_angle_rad, request.seed, vehicles);
  };
  made.sensor = eyes.sensor;
  if (!options.trace.folder.empty())
    made.observer = [trace = options.trace](const planner::Profile& profile, const protocol::SessionRequest& request) {
      return make_tracer(request, profile, trace);
    };
  return made;
}

/// The server's way to others: its own discovery server first, if there shall be one.
class Wire {
 public:
  Wire(const Options& options, std::function<void(const dds::DroppedPackets&)> on_dropped)
      : options_(options), network_(options.network), on_dropped_(std::move(on_dropped)) {}

  Status introduce() {
    if (options_.discovery_port == 0) return {};
    for (const auto& [given, name] : {std::pair(!network_.peers.empty(), "--peer"),
                                      std::pair(!network_.discovery_servers.empty(), "--discovery-server")})
      if (given) return Error::invalid(name, "given beside --discovery-listen", "one of the two");
    auto own = dds::own_discovery_server(options_.discovery_port, network_);
    if (!own) return own.failure();
    dds::TransportOptions transport;
    transport.network = network_;
    transport.on_packets_dropped = on_dropped_;
    auto opened = dds::DiscoveryServer::open(options_.domain, options_.discovery_port, transport);
    if (!opened) return opened.failure();
    introducer_ = std::move(opened).value();
    network_.discovery_servers = {*own};
    log::info("discovery server: port " + std::to_string(options_.discovery_port));
    return {};
  }
  const dds::NetworkOptions& network() const { return network_; }

 private:
  const Options& options_;
  dds::NetworkOptions network_;
  const std::function<void(const dds::DroppedPackets&)> on_dropped_;
  std::unique_ptr<dds::DiscoveryServer> introducer_;
};

/// On the thread that found it out. Vehicles are told by the one that waits for signals; if that is stuck, this ends
/// the process alone: it must not live on and hear nothing.
void end_as_deaf(std::atomic<bool>* deaf) {
  log::error(
      "shared memory no longer brings anything: a program that used it was killed (decision 0046). This server ends, "
      "to be started again; without --shared-memory this can't happen");
  deaf->store(true);
  std::this_thread::sleep_for(std::chrono::seconds(2));
  std::_Exit(kDeaf);
}

/// What vehicles will cost, and the log says so.
service::Costs tried(const service::Profiles& profiles, const service::Factories& made_from) {
  service::Costs costs = service::costs_by_trial(profiles, made_from);
  std::string words;
  for (const auto& [name, profile] : profiles)
    words += (words.empty() ? "" : ", ") + name + " " + fixed(costs.of(profile, default_camera().rate_hz).all(), 3);
  log::info("cores that a vehicle takes, by profile: " + words);
  return costs;
}

/// Prints a profile with all that its file leaves unsaid.
Status show_profile(const Options& options) {
  const auto folder = profiles_folder(options);
  if (!folder) return folder.failure();
  const auto profiles = load_profiles(*folder);
  if (!profiles) return profiles.failure();
  const auto shown = profiles->find(options.shown_profile);
  if (shown == profiles->end())
    return Error::invalid("--show-profile", "'" + options.shown_profile + "'",
                          "one of " + names_of(*profiles) + " (" + folder->string() + ")", ErrorCode::kUnknownName);
  std::cout << planner::to_text(shown->second);
  return {};
}

}  // namespace

int serve(const std::string& program, const Options& options,
          const std::function<Result<Eyes>(const kernels::Backend&)>& open_eyes) {
  if (!options.shown_profile.empty()) {
    const Status status = show_profile(options);
    return status ? 0 : fail(program, kBadInput, status.error());
  }
  log::start(program, options.log_level, options.log_format == "json" ? log::Format::kJson : log::Format::kText);
  const auto surroundings = dds::settle_environment(options.network);
  const Signals signals;  // before any thread is there: one that doesn't block them would end the program
  const auto fail_with = [&program](int code, const std::string& sentence) { return fail(program, code, sentence); };
  const auto backend = kernels::select_backend(options.isa);
  if (!backend) return fail_with(kBadInput, "--isa: " + backend.error());
  if (const Status status = protocol::validate_name("--name", options.name); !status)
    return fail_with(kBadInput, status.error());
  for (const auto& [option, partner] :
       {std::pair("--standby", options.standby), std::pair("--standby-of", options.standby_of)}) {
    if (partner.empty()) continue;
    if (const Status status = protocol::validate_name(option, partner); !status)
      return fail_with(kBadInput, status.error());
    if (partner == options.name)
      return fail_with(kBadInput, std::string(option) + " is " + partner + ", expected the name of another server");
  }
  const auto folder = profiles_folder(options);
  if (!folder) return fail_with(kBadInput, folder.error());
  const auto eyes = open_eyes(**backend);
  if (!eyes) return fail_with(kBadInput, eyes.error());
  const auto profiles = profiles_for(*eyes, *folder);
  if (!profiles) return fail_with(kBadInput, profiles.error());

  service::ServiceOptions serving;
  serving.name = options.name;
  serving.max_vehicles = options.max_vehicles;
  serving.control_threads = options.threads > 0 ? options.threads : service::default_control_threads();
  serving.perception_threads = options.perception_threads;
  serving.realtime = options.realtime;
  serving.cores = options.cores;
  kernels::Crew crew(serving.control_threads);
  serving.crew = &crew;
  serving.isa = std::string((*backend)->name());
  serving.model_hash = eyes->model_hash;
  serving.profiles = *profiles;
  serving.utilisation = options.utilisation;
  serving.max_priority = static_cast<std::uint8_t>(options.max_priority);
  serving.has_heir = !options.standby.empty();
  serving.stands_by = !options.standby_of.empty();
  const service::Factories made_from = factories(options, *eyes, {.crew = &crew, .backend = *backend});

  log::info("GATEFIELD " GATEFIELD_VERSION ", instruction set " + serving.isa + ", " + eyes->words);
  for (const std::string& warning : eyes->warnings) log::warn(warning);
  for (const std::string& sentence : surroundings) log::warn(sentence);
  log::info("profiles " + names_of(*profiles) + " (" + folder->string() + "), " +
            std::to_string(serving.control_threads) + " control and " + std::to_string(serving.perception_threads) +
            " perception threads, at most " + std::to_string(serving.max_vehicles) + " vehicles");
  if (options.utilisation > 0.0) serving.costs = tried(*profiles, made_from);
  if (options.realtime)
    if (const std::string why = lock_memory(); !why.empty()) log::warn(why);

  const MonotonicClock clock;
  dds::log_library_lines();
  DdsTransport transport;
  service::Service service(serving, made_from, &clock, &transport);
  transport.attach(&service);
  std::atomic<std::uint64_t> packets_dropped{0};
  const auto on_packets_dropped = [&packets_dropped](const dds::DroppedPackets& dropped) {
    packets_dropped.fetch_add(dropped.count, std::memory_order_relaxed);
    log::warn(in_words(dropped));
  };
  Wire wire(options, on_packets_dropped);
  if (const Status status = wire.introduce(); !status) return fail_with(kNotJoined, status.error());
  std::atomic<bool> deaf{false};
  auto endpoint = dds::ServerEndpoint::create(
      options.domain, options.name, &transport,
      {.network = wire.network(),
       .on_packets_dropped = on_packets_dropped,
       .on_deaf = [&deaf] { end_as_deaf(&deaf); },
       .on_samples_dropped = [](const dds::DroppedSamples& dropped) { log::warn(in_words(dropped)); }},
      {.heir = options.standby, .leader = options.standby_of});
  if (!endpoint)
    return fail_with(dds::is_about_security(endpoint.failure()) ? kBadInput : kNotJoined, endpoint.error());
  transport.attach(endpoint.value().get());
  service.start();
  if (const std::string why = service.realtime_complaint(); !why.empty()) log::warn(why);

  Watch watch({.service = &service,
               .clock = &clock,
               .words = {.version = GATEFIELD_VERSION,
                         .name = options.name,
                         .isa = serving.isa,
                         .model_hash = eyes->model_hash,
                         .domain = options.domain},
               .deaf = [&deaf] { return deaf.load(); },
               .packets_dropped = [&packets_dropped] { return packets_dropped.load(std::memory_order_relaxed); },
               .reload =
                   [&] {
                     auto again = profiles_for(*eyes, *folder);
                     if (!again) return log::error("SIGHUP: the profiles stay as they are: " + again.error());
                     log::info("SIGHUP: profiles " + names_of(*again) + " for sessions that begin from now on");
                     service.set_profiles(std::move(again).value());
                   },
               .drain =
                   [&] {
                     log::info("SIGUSR1: takes no newcomers any more, and ends with the last of " +
                               std::to_string(service.sessions()) + " vehicles");
                     service.drain();
                   }});
  if (const Status offered = watch.offer(options.metrics); !offered) return fail_with(kBadInput, offered.error());
  log::info("ready: server " + options.name + " in DDS domain " + std::to_string(options.domain) +
            (options.standby_of.empty() ? "" : ", stands by for " + options.standby_of));

  const std::string why = watch.run(signals);
  log::info(why + ": telling " + std::to_string(service.sessions()) + " vehicles, then ending");
  service.stop();
  if (deaf) std::_Exit(kDeaf);  // taking the middleware down may wait for what is stuck
  endpoint.value().reset();     // hears nothing more; the service may go then
  return 0;
}

void add_options(CLI::App* app, Options* options) {
  app->add_option("--profiles", options->profiles,
                  "Folder of planner profiles, every *.txt is one; else profiles/ of $GATEFIELD_CONFIG, of "
                  "share/gatefield/config of the installation or of the sources' deploy/config")
      ->type_name("FOLDER");
  app->add_option("--show-profile", options->shown_profile,
                  "Print this profile with every field, its value and its range, and end")
      ->type_name("NAME");
  app->add_option("--domain", options->domain, "DDS domain, 0 to 232")
      ->check(CLI::Range(0u, dds::kMaxDomain))
      ->capture_default_str();
  app->add_option("--name", options->name, "The server's name, one server for each name in a domain")
      ->capture_default_str();
  app->add_option(
         "--standby", options->standby,
         "Name of the server that goes on with the vehicles of this one when it falls silent; it is started with "
         "--standby-of")
      ->type_name("NAME");
  app->add_option("--standby-of", options->standby_of,
                  "Follows the vehicles of the server of that name, and takes them over when it falls silent")
      ->type_name("NAME");
  app->add_option("--threads", options->threads, "Control threads; 0 = one per core but one, or two on two cores")
      ->check(CLI::Range(0, 256))
      ->capture_default_str();
  app->add_option("--perception-threads", options->perception_threads, "Threads that look at depth frames")
      ->check(CLI::Range(1, 256))
      ->capture_default_str();
  app->add_option("--max-vehicles", options->max_vehicles, "Vehicles served at once; more are told that it is busy")
      ->check(CLI::Range(1, 256))
      ->capture_default_str();
  app->add_option("--utilisation", options->utilisation,
                  "Part of the cores that vehicles may take, as measured; who is beyond is told that there is no room, "
                  "and late ticks cost the newest its session. 0: neither, --max-vehicles alone counts")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  app->add_option(
         "--max-priority", options->max_priority,
         "Priority that requests may have, 0 to 9; more counts as this. With more than 5, vehicles can displace "
         "those of the usual priority")
      ->check(CLI::Range(0, int{protocol::kMaxPriority}))
      ->capture_default_str();
  std::string isas = "auto";
  for (const auto* backend : kernels::available_backends()) isas += ", " + std::string(backend->name());
  app->add_option("--isa", options->isa, "Instruction set of the kernels, one of: " + isas)->capture_default_str();
  app->add_option("--log-level", options->log_level, "What to write to standard error")
      ->check(CLI::IsMember({"trace", "debug", "info", "warn", "error", "off"}))
      ->capture_default_str();
  app->add_option("--log-format", options->log_format, "Lines for people, or one JSON object a line")
      ->check(CLI::IsMember({"text", "json"}))
      ->capture_default_str();
  app->add_option("--metrics", options->metrics,
                  "Address for the pages /metrics (Prometheus) and /healthz, such as 127.0.0.1:9464; none unless told")
      ->type_name("HOST:PORT");
  app->add_flag("--realtime", options->realtime,
                "Real-time priority for the control threads, and all memory locked; says so when it is not permitted");
  app->add_option("--trace", options->trace.folder,
                  "Folder for what the planner believed at each step, a file a vehicle; for evaluation, as the control "
                  "step then writes to the disk")
      ->type_name("FOLDER");
  app->add_flag("--trace-rollouts", options->trace.rollouts, "And some of the rollouts that it weighed");
  app->add_option("--cores", options->cores,
                  "Cores that the control threads are bound to in turn, such as 2,3; else wherever the system likes")
      ->delimiter(',')
      ->check(CLI::Range(0, 1023))
      ->type_name("LIST");
  dds::add_network_options(app, &options->network);
  app->add_option("--discovery-listen", options->discovery_port,
                  "UDP port of a discovery server within this one, for clients with --discovery-server; usually 11811")
      ->check(CLI::Range(1, 65535))
      ->type_name("PORT")
      ->group("Network");
}

int run_program(CLI::App* app, int argc, char** argv, const std::function<int()>& body) {
  try {
    app->parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    const int code = app->exit(error);
    return code == 0 ? 0 : kBadInput;
  }
  try {
    return body();
  } catch (const std::exception& error) {
    return fail(app->get_name(), 1, std::string("ended by an error that nobody expected: ") + error.what());
  }
}

}  // namespace gatefield::app
