#include "client/race/flyer.h"

#include <unistd.h>

#include <utility>

#include "client/race/files.h"
#include "client/simulator/simulation.h"
#include "common/config/locate.h"

namespace gatefield::race {
namespace {

using namespace std::chrono_literals;
namespace fs = std::filesystem;

constexpr auto kServerStart = 60s;
constexpr auto kConnect = 3s;
constexpr int kConnectAttempts = 10;
/// Below 100 the ports of a domain stay clear of those that the system gives to outgoing connections.
constexpr std::uint32_t kFirstDomain = 10, kDomains = 90;

}  // namespace

Result<fs::path> find_model(const std::string& name) {
  std::error_code failure;
  if (fs::exists(fs::path(name) / "manifest.txt", failure)) return fs::absolute(name);
  const auto config = config::config_folder();
  if (!config) return config.failure();
  const fs::path shipped = config->parent_path() / "models" / name;
  if (fs::exists(shipped / "manifest.txt", failure)) return shipped;
  return Error{"model '" + name + "' is neither a folder nor one of " + shipped.parent_path().string() +
                   ", expected a folder with manifest.txt",
               ErrorCode::kUnknownName, "model"};
}

ServerFlyer::ServerFlyer(ServerOptions options, int worker) : options_(std::move(options)), worker_(worker) {
  if (!options_.name.empty()) {
    domain_ = options_.domain;
    server_name_ = options_.name;
  } else {
    Fingerprint place;  // spreads the processes of one machine, and of several, over the domains
    place.add(host_name());
    place.add(std::to_string(getpid()));
    domain_ = kFirstDomain + static_cast<std::uint32_t>((place.value() + static_cast<unsigned>(worker)) % kDomains);
  }
}

void ServerFlyer::set_server(std::shared_ptr<ChildProcess> server) {
  const std::lock_guard lock(mutex_);
  server_.swap(server);
}

bool ServerFlyer::lost() {
  std::shared_ptr<ChildProcess> server;
  {
    const std::lock_guard lock(mutex_);
    server = server_;
  }
  return server && !server->running();
}

Result<std::vector<std::string>> ServerFlyer::server_arguments(const Trial& trial) const {
  const Cell& cell = *trial.cell;
  std::vector<std::string> arguments;
  if (cell.perception == Perception::kLearned) {
    const auto folder = find_model(cell.model);
    if (!folder) return folder.failure();
    arguments = {options_.program, "--model", folder->string()};
  } else {
    arguments = {options_.baseline_program, "--perception", name(cell.perception), "--scenario",
                 (options_.cells / (cell.name + ".txt")).string()};
    if (cell.perception == Perception::kTruePose)
      arguments.insert(arguments.end(), {"--world-seed", std::to_string(trial.seed)});
  }
  for (const auto& [option, value] : {std::pair<std::string, std::string>("--domain", std::to_string(domain_)),
                                      {"--name", server_name_},
                                      {"--profiles", options_.profiles.string()},
                                      {"--threads", "1"},
                                      {"--perception-threads", "1"},
                                      {"--log-level", "info"},
                                      {"--isa", options_.isa},
                                      {"--trace", options_.traces.string()}})
    if (!value.empty()) arguments.insert(arguments.end(), {option, value});
  arguments.insert(arguments.end(), options_.network_words.begin(), options_.network_words.end());
  if (cell.rollouts && !options_.traces.empty()) arguments.emplace_back("--trace-rollouts");
  return arguments;
}

Status ServerFlyer::ensure_server(const Trial& trial, const std::atomic<bool>& cancel, std::string* why_lost) {
  if (!options_.name.empty()) return {};
  if (server_ && server_->running() && server_key(trial) == key_) return {};
  set_server(nullptr);
  // Each start has a name of its own, so that nothing of the one before can be taken for its words.
  server_name_ = "race-" + host_name() + "-" + std::to_string(getpid()) + "-" + std::to_string(worker_) + "-" +
                 std::to_string(++starts_);
  const auto arguments = server_arguments(trial);
  if (!arguments) return arguments.failure();
  std::error_code failure;
  if (!options_.traces.empty()) fs::create_directories(options_.traces, failure);
  // Shards may share the folder, and the machine.
  const fs::path log = options_.logs / ("server-" + host_name() + "-" + std::to_string(getpid()) + "-" +
                                        std::to_string(worker_) + ".log");
  auto server = start_server(*arguments, log, kServerStart, cancel);
  if (!server) {
    const ErrorCode code = server.failure().code;
    if (code == ErrorCode::kInvalid || code == ErrorCode::kUnreadable) return server.failure();
    *why_lost = server.error();
    return {};
  }
  key_ = server_key(trial);
  set_server(std::move(server).value());
  return {};
}

/// Reads and removes what the server wrote of this vehicle; it was written before the last answer came.
std::vector<trace::Step> ServerFlyer::take_trace(const std::string& vehicle) const {
  if (options_.traces.empty() || !options_.name.empty()) return {};
  const fs::path file = options_.traces / (vehicle + ".trace");
  auto steps = trace::read(file);
  std::error_code failure;
  fs::remove(file, failure);
  return steps ? std::move(steps).value() : std::vector<trace::Step>{};
}

Result<Flight> ServerFlyer::fly(const Trial& trial, const std::atomic<bool>& cancel) {
  Flight flight;
  if (auto status = ensure_server(trial, cancel, &flight.why); !status) return status.failure();
  if (cancel || !flight.why.empty()) {
    flight.end = cancel ? Flight::End::kCancelled : Flight::End::kLost;
    return flight;
  }

  config::Scenario scenario = trial.cell->scenario;
  scenario.seed = trial.seed;
  scenario.planner_seed = trial.seed_of_planner();
  sdk::Options link = simulator::session_options(scenario, protocol::Timing::kLockstep);
  link.domain = domain_;
  link.network = options_.network;
  link.server = server_name_;
  link.vehicle = "race-" + host_name() + "-" + std::to_string(getpid()) + "-" + std::to_string(worker_) + "-" +
                 std::to_string(++flights_);
  link.profile = trial.cell->profile;
  link.speed_limit_m_s = trial.speed_m_s;
  link.connect_timeout = kConnect;

  std::unique_ptr<sdk::Client> client;
  for (int attempt = 0; !client && attempt < kConnectAttempts && !cancel && !lost(); ++attempt) {
    auto connected = sdk::Client::connect(link, &cancel);
    if (connected) {
      client = std::move(connected).value();
    } else {
      flight.why = connected.error();
      if (!may_pass(connected.failure().code)) return connected.failure().within(trial.name() + ": ");
    }
  }
  if (client) {
    simulator::Options options;
    options.timing = protocol::Timing::kLockstep;
    options.link_delay = from_seconds(2e-3 * trial.cell->link.each_way_ms);
    options.link_jitter = from_seconds(1e-3 * trial.cell->link.jitter_ms);
    options.link_loss = trial.cell->link.loss;
    options.link_outage = from_seconds(trial.cell->link.outage_s);
    // After a long outage the vehicle is somewhere else, and the server believes it only at the third state.
    const bool outage = options.link_outage > Stamp{0};
    const std::uint64_t unanswered = outage ? 2 : 0;
    options.answer_timeout = outage ? std::chrono::milliseconds(1000) : options_.answer_limit;
    options.give_up = options_.answer_limit;
    auto report = simulator::fly(scenario, options, client.get(), cancel);
    if (!report) return report.failure().within(trial.name() + ": ");
    // A state that was never answered was flown past on the last plan: no flight that could be repeated.
    const bool whole = report->late_ticks <= unanswered && report->doubtful_ticks == 0 &&
                       report->link.reconnects == 0 && report->link.take_overs == 0 &&
                       report->outcome != simulator::Outcome::kInterrupted &&
                       report->outcome != simulator::Outcome::kLinkLost;
    if (whole) {
      flight.end = Flight::End::kFlown;
      flight.trace = take_trace(link.vehicle);
      flight.result = to_result(trial, *report, flight.trace);
      flight.result.model = client->session().model_hash;
      if (const auto command = client->newest()) flight.result.isa = command->isa.data();
      flight.report = std::move(report).value();
      return flight;
    }
    take_trace(link.vehicle);
    flight.why = "of " + std::to_string(report->control_ticks) + " states the server left " +
                 std::to_string(report->late_ticks) + " without an answer and answered " +
                 std::to_string(report->doubtful_ticks) + " so late that their frames may be missing";
  }
  const auto died = server_ ? server_->wait(0ms) : std::nullopt;
  if (died) flight.why = "the server ended " + text(*died) + ": " + server_->last_line();
  flight.end = cancel && !died ? Flight::End::kCancelled : Flight::End::kLost;
  client.reset();
  set_server(nullptr);  // one that hangs is no better than a dead one
  return flight;
}

}  // namespace gatefield::race
