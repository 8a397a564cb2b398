#include "server/app/program.h"

#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <iostream>

#include "common/base/clock.h"
#include "common/base/logging.h"
#include "common/config/locate.h"
#include "common/dds/library_log.h"
#include "common/dds/server_endpoint.h"
#include "common/protocol/validate.h"
#include "server/app/data_files.h"
#include "server/app/dds_transport.h"
#include "server/app/signals.h"
#include "server/app/watch.h"
#include "server/kernels/backend.h"
#include "server/kernels/crew.h"
#include "server/planner/planner.h"
#include "server/service/service.h"

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

}  // namespace

int serve(const std::string& program, const Options& options,
          const std::function<Result<Eyes>(const kernels::Backend&)>& open_eyes) {
  log::start(program, options.log_level, options.log_format == "json" ? log::Format::kJson : log::Format::kText);
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
  serving.model_gate_inner_half_m = eyes->gate_inner_half_m;
  serving.profiles = *profiles;
  serving.has_heir = !options.standby.empty();
  serving.stands_by = !options.standby_of.empty();

  log::info("GATEFIELD " GATEFIELD_VERSION ", instruction set " + serving.isa + ", " + eyes->words);
  for (const std::string& warning : eyes->warnings) log::warn(warning);
  log::info("profiles " + names_of(*profiles) + " (" + folder->string() + "), " +
            std::to_string(serving.control_threads) + " control and " + std::to_string(serving.perception_threads) +
            " perception threads, at most " + std::to_string(serving.max_vehicles) + " vehicles");
  if (options.realtime)
    if (const std::string why = lock_memory(); !why.empty()) log::warn(why);

  const MonotonicClock clock;
  dds::set_library_log([](const std::string& line) { log::warn(line); });
  DdsTransport transport;
  service::Service service(serving, factories(options, *eyes, {.crew = &crew, .backend = *backend}), &clock,
                           &transport);
  transport.attach(&service);
  std::atomic<std::uint64_t> packets_dropped{0};
  const auto on_packets_dropped = [&packets_dropped](const dds::DroppedPackets& dropped) {
    packets_dropped.fetch_add(dropped.count, std::memory_order_relaxed);
    log::warn(in_words(dropped));
  };
  auto endpoint = dds::ServerEndpoint::create(
      options.domain, options.name, &transport,
      {.on_packets_dropped = on_packets_dropped,
       .on_samples_dropped = [](const dds::DroppedSamples& dropped) { log::warn(in_words(dropped)); }},
      {.heir = options.standby, .leader = options.standby_of});
  if (!endpoint) return fail_with(kNotJoined, endpoint.error());
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
                     log::info("SIGUSR1: newcomers are not answered, and it ends with the last of " +
                               std::to_string(service.sessions()) + " vehicles");
                     service.drain();
                   }});
  if (const Status offered = watch.offer(options.metrics); !offered) return fail_with(kBadInput, offered.error());
  log::info("ready: server " + options.name + " in DDS domain " + std::to_string(options.domain) +
            (options.standby_of.empty() ? "" : ", stands by for " + options.standby_of));

  const std::string why = watch.run(signals);
  log::info(why + ": telling " + std::to_string(service.sessions()) + " vehicles, then ending");
  service.stop();
  endpoint.value().reset();  // hears nothing more; the service may go then
  return 0;
}

void add_options(CLI::App* app, Options* options) {
  app->add_option("--profiles", options->profiles,
                  "Folder of planner profiles, every *.txt is one; else profiles/ of $GATEFIELD_CONFIG, of "
                  "share/gatefield/config of the installation or of the sources' deploy/config")
      ->type_name("FOLDER");
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
