// gatefield-server: reads model and profiles, joins the DDS domain, and serves until it is told to end.

#include <signal.h>
#include <sys/mman.h>
#include <sys/resource.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <iostream>
#include <string>
#include <thread>

#include "common/base/clock.h"
#include "common/base/logging.h"
#include "common/config/locate.h"
#include "common/dds/server_endpoint.h"
#include "common/model/bundle.h"
#include "common/protocol/validate.h"
#include "server/app/data_files.h"
#include "server/app/dds_transport.h"
#include "server/app/trace.h"
#include "server/kernels/backend.h"
#include "server/perception/depth_encoder.h"
#include "server/planner/planner.h"
#include "server/service/service.h"

namespace gatefield::app {
namespace {

constexpr int kBadInput = 2;   // arguments, model or configuration
constexpr int kNotJoined = 3;  // a server of this name is in the domain, or the middleware refuses

constexpr const char* kDescription =
    "Plans for drones that race through gates: depth images and vehicle states in, thrust-rate plans out, over DDS.";

constexpr const char* kFooter = R"(Examples:
  gatefield-server
      the model and the profiles that come with it, DDS domain 0
  gatefield-server --domain 7 --name lab --model ~/models/night --log-level debug
      another domain, another name, a model of your own
  gatefield-server --profiles ~/profiles --max-vehicles 4 --threads 4 --realtime
      your own planner profiles; four vehicles; real-time priority (needs CAP_SYS_NICE and CAP_IPC_LOCK, or root)
  gatefield-server --isa avx2
      forces an instruction set, to compare machines

Exit codes: 0 ended by SIGINT or SIGTERM, 2 arguments, model or configuration, 3 the domain could not be joined
(a server of the same name is there already).)";

struct Arguments {
  std::string model;
  std::string profiles;
  std::uint32_t domain = 0;
  std::string name = "gatefield";
  int threads = 0;
  int perception_threads = 1;
  int max_vehicles = 8;
  std::string isa = "auto";
  std::string log_level = "info";
  bool realtime = false;
  std::vector<int> cores;
  TraceOptions trace;
};

int fail(int code, const std::string& sentence) {
  std::cerr << "gatefield-server: " << sentence << "\n";
  return code;
}

std::string hex(std::uint64_t value) {
  char buffer[20];
  std::snprintf(buffer, sizeof buffer, "%016llx", static_cast<unsigned long long>(value));
  return buffer;
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

int run(const Arguments& arguments) {
  log::start("gatefield-server", arguments.log_level);
  const auto backend = kernels::select_backend(arguments.isa);
  if (!backend) return fail(kBadInput, "--isa: " + backend.error());
  if (const Status status = protocol::validate_name("--name", arguments.name); !status)
    return fail(kBadInput, status.error());

  std::filesystem::path model_folder = arguments.model;
  if (model_folder.empty()) {
    auto found = find_data_folder("models/race", "--model FOLDER");
    if (!found) return fail(kBadInput, found.error());
    model_folder = *found;
  }
  std::filesystem::path profiles_folder = arguments.profiles;
  if (profiles_folder.empty()) {
    auto found = config::config_folder();
    if (!found) return fail(kBadInput, found.error());
    profiles_folder = *found / "profiles";
  }
  auto profiles = load_profiles(profiles_folder);
  if (!profiles) return fail(kBadInput, profiles.error());
  const auto read = model::Bundle::read(model_folder);
  if (!read) return fail(kBadInput, read.error());
  const model::Bundle& bundle = *read;
  // Made once here, so that a model whose networks don't load is found before anyone can join.
  if (auto encoder = perception::DepthEncoder::create(bundle); !encoder) return fail(kBadInput, encoder.error());

  const std::string isa((*backend)->name());
  std::string names;
  for (const auto& [name, profile] : *profiles) names += (names.empty() ? "" : ", ") + name;

  service::ServiceOptions options;
  options.name = arguments.name;
  options.max_vehicles = arguments.max_vehicles;
  options.control_threads = arguments.threads > 0 ? arguments.threads : service::default_control_threads();
  options.perception_threads = arguments.perception_threads;
  options.realtime = arguments.realtime;
  options.cores = arguments.cores;
  kernels::Crew crew(options.control_threads);
  options.crew = &crew;
  options.isa = isa;
  options.model_hash = bundle.hash();
  options.model_gate_inner_half_m = bundle.manifest().gate_inner_half_m;
  options.sight.validity_threshold = bundle.manifest().validity_threshold;
  options.sight.takes_prior = bundle.manifest().encoder_kind == "two_look";
  options.profiles = std::move(profiles).value();

  const double cone_angle_rad = bundle.manifest().cone_angle_rad;
  service::Factories factories;
  factories.planner = [&arguments, cone_angle_rad, &crew, &backend](const planner::Profile& profile,
                                                                    const protocol::SessionRequest& request) {
    return traced(planner::Planner::create(profile, request.quadrotor, request.course.waypoints[0].gate, cone_angle_rad,
                                           request.seed, {.crew = &crew, .backend = *backend}),
                  request, arguments.trace);
  };
  factories.memory = [&bundle,
                      decoder = (*backend)->prepare(bundle.decoder())](const protocol::SessionRequest& request) {
    return service::make_memory(bundle, decoder, request.course);
  };
  factories.encoder = [&bundle] { return perception::DepthEncoder::create(bundle); };

  log::info("GATEFIELD " GATEFIELD_VERSION ", instruction set " + isa + ", model " + bundle.manifest().name + " (" +
            model_folder.string() + ", hash " + hex(bundle.hash()) + ")");
  for (const std::string& warning : bundle.warnings()) log::warn(warning);
  log::info("profiles " + names + " (" + profiles_folder.string() + "), " + std::to_string(options.control_threads) +
            " control and " + std::to_string(options.perception_threads) + " perception threads, at most " +
            std::to_string(options.max_vehicles) + " vehicles");
  if (arguments.realtime)
    if (const std::string why = lock_memory(); !why.empty()) log::warn(why);

  // Signals are taken by this thread alone; all others inherit the mask.
  sigset_t ending;
  sigemptyset(&ending);
  sigaddset(&ending, SIGINT);
  sigaddset(&ending, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &ending, nullptr);

  const MonotonicClock clock;
  DdsTransport transport;
  service::Service service(options, factories, &clock, &transport);
  transport.attach(&service);
  auto endpoint = dds::ServerEndpoint::create(arguments.domain, arguments.name, &transport);
  if (!endpoint) return fail(kNotJoined, endpoint.error());
  transport.attach(endpoint.value().get());
  if (const Status status = service.start(); !status) return fail(kBadInput, status.error());
  if (const std::string why = service.realtime_complaint(); !why.empty()) log::warn(why);
  log::info("ready: server " + arguments.name + " in DDS domain " + std::to_string(arguments.domain));

  int signal = 0;
  while (signal <= 0) {
    const timespec second{1, 0};
    signal = sigtimedwait(&ending, nullptr, &second);
  }
  log::info(std::string(signal == SIGINT ? "SIGINT" : "SIGTERM") + ": telling " + std::to_string(service.sessions()) +
            " vehicles, then ending");
  service.stop();
  endpoint.value().reset();  // hears nothing more; the service may go then
  return 0;
}

}  // namespace
}  // namespace gatefield::app

int main(int argc, char** argv) {
  gatefield::app::Arguments arguments;
  CLI::App app{gatefield::app::kDescription, "gatefield-server"};
  app.footer(gatefield::app::kFooter);
  app.set_version_flag("--version", "gatefield-server " GATEFIELD_VERSION);
  app.add_option("--model", arguments.model,
                 "Folder of a trained model (manifest.txt and its ONNX files); else models/race of the installation's "
                 "share/gatefield, of the sources' deploy, or of ./deploy")
      ->type_name("FOLDER");
  app.add_option("--profiles", arguments.profiles,
                 "Folder of planner profiles, every *.txt is one; else profiles/ of $GATEFIELD_CONFIG, of "
                 "share/gatefield/config of the installation or of the sources' deploy/config")
      ->type_name("FOLDER");
  app.add_option("--domain", arguments.domain, "DDS domain, 0 to 232")
      ->check(CLI::Range(0u, gatefield::dds::kMaxDomain))
      ->capture_default_str();
  app.add_option("--name", arguments.name, "The server's name, one server for each name in a domain")
      ->capture_default_str();
  app.add_option("--threads", arguments.threads, "Control threads; 0 = one per core but one, or two on two cores")
      ->check(CLI::Range(0, 256))
      ->capture_default_str();
  app.add_option("--perception-threads", arguments.perception_threads, "Threads that encode depth frames")
      ->check(CLI::Range(1, 256))
      ->capture_default_str();
  app.add_option("--max-vehicles", arguments.max_vehicles, "Vehicles served at once; more are told that it is busy")
      ->check(CLI::Range(1, 256))
      ->capture_default_str();
  std::string isas = "auto";
  for (const auto* backend : gatefield::kernels::available_backends()) isas += ", " + std::string(backend->name());
  app.add_option("--isa", arguments.isa, "Instruction set of the kernels, one of: " + isas)->capture_default_str();
  app.add_option("--log-level", arguments.log_level, "What to write to standard error")
      ->check(CLI::IsMember({"trace", "debug", "info", "warn", "error", "off"}))
      ->capture_default_str();
  app.add_flag("--realtime", arguments.realtime,
               "Real-time priority for the control threads, and all memory locked; says so when it is not permitted");
  app.add_option("--trace", arguments.trace.folder,
                 "Folder for what the planner believed at each step, a file a vehicle; for evaluation, as the control "
                 "step then writes to the disk")
      ->type_name("FOLDER");
  app.add_flag("--trace-rollouts", arguments.trace.rollouts, "And some of the rollouts that it weighed");
  app.add_option("--cores", arguments.cores,
                 "Cores that the control threads are bound to in turn, such as 2,3; else wherever the system likes")
      ->delimiter(',')
      ->check(CLI::Range(0, 1023))
      ->type_name("LIST");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    const int code = app.exit(error);
    return code == 0 ? 0 : gatefield::app::kBadInput;
  }
  try {
    return gatefield::app::run(arguments);
  } catch (const std::exception& error) {
    return gatefield::app::fail(1, std::string("ended by an error that nobody expected: ") + error.what());
  }
}
