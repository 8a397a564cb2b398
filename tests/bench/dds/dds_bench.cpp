// How fast the wire is on this machine, and how many vehicles a server flies over it: the product's endpoints and QoS.
//   gatefield-dds-bench [seconds per measurement, 5 unless told] [file for results as JSON]
//
// The wire alone, over UDP on the loopback and over shared memory: state to command and back at 500 Hz from a process
// that answers at once, while 60 depth frames of 160 x 90 a second go by; and how long those are under way.
//
// gatefield-server in lockstep, a gate in sight, the race profile (M = 2048): from a state's leaving to the command's
// coming at 50 Hz, and what of it goes beyond the step that the server made for just this state. Each state is answered
// once, so that no wait for a control tick is in it.
//
// gatefield-server in real time with many vehicles (M = 1024, 50 Hz, states at 100 Hz, depth at 30 Hz): the share of
// control ticks whose command left in time, as the server counts it. All vehicles live in this process, on the same
// cores: what they and the server cost is told beside it.

#include <sys/resource.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "common/base/whole_file.h"
#include "common/config/locate.h"
#include "tests/bench/dds/echo.h"
#include "tests/bench/dds/vehicle.h"
#include "tests/bench/timings.h"
#include "tests/support/keys.h"
#include "tests/support/process.h"

namespace gatefield::bench {
namespace {

using namespace std::chrono_literals;
namespace fs = std::filesystem;

constexpr std::chrono::milliseconds kPatience = 30s;  // with a server that starts, and reads its model

/// What was measured: a line each for people, an entry each for `gatefield-bench report`.
class Results {
 public:
  void add(const std::string& name, const std::vector<double>& values_s, const std::string& fields = {}) {
    std::printf("%s\n", line_us(name, values_s).c_str());
    std::fflush(stdout);
    if (!values_s.empty()) add_entry("dds/" + name, fields_us("", values_s) + fields);
  }
  void add_entry(const std::string& name, const std::string& fields) {
    entries_ += (entries_.empty() ? "" : ",\n") + (R"({"name": ")" + name + "\"") + fields + "}";
  }
  std::string json() const { return "{\"benchmarks\": [\n" + entries_ + "\n]}\n"; }

 private:
  std::string entries_;
};

constexpr const char* kVehicle = "bench-vehicle";

/// Below those that tests and campaigns use: a server of theirs must not answer.
std::uint32_t own_domain() { return 1 + static_cast<std::uint32_t>(getpid()) % 9; }

fs::path beside(const std::string& program) {
  std::error_code failed;
  return program.empty() ? fs::read_symlink("/proc/self/exe", failed)
                         : fs::read_symlink("/proc/self/exe", failed).parent_path() / program;
}

/// Processor time that a process of ours has had, seconds. @param pid  0: this one
double processor_time_s(pid_t pid) {
  if (pid == 0) {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    const auto s = [](const timeval& t) {
      return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
    };
    return s(usage.ru_utime) + s(usage.ru_stime);
  }
  std::ifstream in("/proc/" + std::to_string(pid) + "/stat");
  std::string word;
  double ticks = 0.0;
  in.ignore(4096, ')');  // the name may contain anything
  for (int field = 3; field <= 15 && in >> word; ++field)
    if (field >= 14) ticks += std::atof(word.c_str());
  return ticks / static_cast<double>(sysconf(_SC_CLK_TCK));
}

class Bench {
 public:
  explicit Bench(double length_s) : length_s_(length_s), folder_(fs::temp_directory_path() / folder_name()) {
    fs::create_directories(folder_);
  }
  ~Bench() {
    std::error_code failed;
    fs::remove_all(folder_, failed);
  }

  /// @param how  "", "in-shared-memory" or "in-closed-domain"
  bool wire_alone(const std::string& how) {
    const Wire wire{own_domain(), how == "in-shared-memory", how == "in-closed-domain" ? keys() : ""};
    const std::string over = wire.shared_memory ? "shared memory" : wire.keys.empty() ? "UDP" : "UDP, encrypted";
    test::Process other(beside("").string(),
                        {"echo", std::to_string(wire.domain), wire.shared_memory ? "1" : "0", wire.keys},
                        folder_ / "echo.out");
    Vehicle vehicle(kVehicle);
    if (!vehicle.ask(wire, protocol::Timing::kLockstep, "race") || !vehicle.joined(kPatience)) return false;
    const auto states = static_cast<std::uint64_t>(500 * length_s_);
    Stamp next = now();
    for (std::uint64_t i = 1; i <= states; ++i) {
      if (i % 25 == 0 || i % 25 == 8 || i % 25 == 16) vehicle.send_frame(now());  // 60 a second
      vehicle.send_state(now());
      next += 2ms;
      std::this_thread::sleep_for(next - now());
    }
    std::this_thread::sleep_for(100ms);
    results_.add("state to command, 500 Hz, " + over + " (wire alone)", round_trips(vehicle.answers(251)));
    if (other.wait(kPatience) != 0) return false;
    std::istringstream lines(other.output());
    results_.add("depth 160 x 90, one way, " + over + " (wire alone)",
                 {std::istream_iterator<double>(lines), std::istream_iterator<double>()});
    return true;
  }

  bool one_vehicle(bool closed) {
    const Wire wire{own_domain(), false, closed ? keys() : ""};
    test::Process server(server_program(),
                         server_arguments(wire, closed ? std::vector<std::string>{"--security", security(wire, kServer)}
                                                       : std::vector<std::string>{}),
                         folder_ / "server.out");
    Vehicle vehicle(kVehicle);
    if (!vehicle.ask(wire, protocol::Timing::kLockstep, "race") || !vehicle.joined(kPatience)) return false;
    Stamp next = now(), simulated = 1s;
    vehicle.send_frame(simulated += 20ms);
    for (int i = 0; i < static_cast<int>(50 * length_s_); ++i) {
      vehicle.send_state(simulated);
      simulated += 20ms;
      next += 20ms;
      std::this_thread::sleep_for(next - now());
    }
    std::this_thread::sleep_for(200ms);
    std::vector<double> steps_s, beyond_s;
    const auto answers = vehicle.answers(26);  // warm by then
    for (const Vehicle::Answer& answer : answers) {
      steps_s.push_back(answer.step_s);
      beyond_s.push_back(answer.round_trip_s - answer.step_s);
    }
    results_.add(std::string("state to command, real server, M = 2048, UDP") + (closed ? ", encrypted" : ""),
                 round_trips(answers), fields_us("step_", steps_s) + fields_us("beyond_", beyond_s));
    std::printf("%s\n%s\n", line_us("  its step", steps_s).c_str(), line_us("  beyond its step", beyond_s).c_str());
    return true;
  }

  bool many_vehicles(int count, bool realtime) {
    const Wire wire{own_domain()};
    if (!write_profile()) return false;
    std::vector<std::string> arguments{"--threads",           "2",          "--max-vehicles",
                                       std::to_string(count), "--profiles", folder_.string()};
    arguments.insert(arguments.end(), {"--utilisation", "0"});  // all of them, whatever they take
    if (realtime) arguments.emplace_back("--realtime");
    test::Process server(server_program(), server_arguments(wire, arguments), folder_ / "server.out");
    std::vector<std::unique_ptr<Vehicle>> fleet;
    for (int i = 0; i < count; ++i) {
      fleet.push_back(std::make_unique<Vehicle>("bench" + std::to_string(i)));
      if (!fleet.back()->ask(wire, protocol::Timing::kRealTime, "bench")) return false;
    }
    for (std::size_t i = 0; i < fleet.size(); ++i) {
      if (!fleet[i]->joined(kPatience)) return false;
      // A server takes vehicles in one after the other, and ends sessions that it hears nothing of.
      for (std::size_t in = 0; in <= i; ++in) fleet[in]->send_state(now());
    }
    fly(fleet, 2.0);  // warm
    const Tally before = tally(fleet);
    const double server_before_s = processor_time_s(server.pid()), own_before_s = processor_time_s(0);
    const Stamp begin = now();
    fly(fleet, length_s_);
    const double passed_s = seconds(now() - begin);
    const double server_s = processor_time_s(server.pid()) - server_before_s;
    const double own_s = processor_time_s(0) - own_before_s;
    const Tally after = tally(fleet);
    const double sent = after.sent - before.sent, missed = after.missed - before.missed;
    const double met_percent = sent > 0.0 ? 100.0 * sent / (sent + missed) : 0.0;
    std::printf(
        "%2d vehicles over the wire%-27s ticks %6.0f   met %7.3f %%   a step %5.2f ms   cores: server %.2f, "
        "vehicles %.2f\n",
        count, realtime ? ", --realtime" : "", sent + missed, met_percent, 1e3 * after.step_s, server_s / passed_s,
        own_s / passed_s);
    std::fflush(stdout);
    char fields[200];
    std::snprintf(fields, sizeof fields,
                  ", \"met_percent\": %.4f, \"ticks\": %.0f, \"step_ms\": %.3f, \"server_cores\": %.3f, "
                  "\"vehicles_cores\": %.3f",
                  met_percent, sent + missed, 1e3 * after.step_s, server_s / passed_s, own_s / passed_s);
    results_.add_entry("fleet/" + std::to_string(count) + (realtime ? "/realtime" : ""), fields);
    return true;
  }

  Status write(const std::string& file) const { return write_file(file, results_.json()); }

 private:
  static std::string folder_name() { return "gatefield-dds-bench-" + std::to_string(getpid()); }
  static std::string server_program() { return beside("gatefield-server").string(); }

  static std::vector<std::string> server_arguments(const Wire& wire, const std::vector<std::string>& more) {
    std::vector<std::string> all{"--domain", std::to_string(wire.domain), "--name", kServer, "--log-level", "warn"};
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }

  static std::vector<double> round_trips(const std::vector<Vehicle::Answer>& answers) {
    std::vector<double> values_s;
    for (const Vehicle::Answer& answer : answers) values_s.push_back(answer.round_trip_s);
    return values_s;
  }

  /// The race profile with half the rollouts, as "bench".
  bool write_profile() const {
    const auto file = config::find_config("profiles", "race");
    std::ifstream in(file ? *file : fs::path());
    std::string text;
    for (std::string line; std::getline(in, line);) {
      if (line.rfind("samples:", 0) == 0) line = "samples: 1024";
      if (line.rfind("name:", 0) == 0) line = "name: \"bench\"";
      text += line + "\n";
    }
    if (text.find("samples: 1024") != std::string::npos && write_file(folder_ / "bench.txt", text)) return true;
    std::fprintf(stderr, "gatefield-dds-bench: no profile could be made of profiles/race.txt\n");
    return false;
  }

  /// Of a closed domain, made at first use.
  std::string keys() {
    if (!keys_) keys_ = std::make_unique<test::Keys>("bench");
    keys_->make("server", kServer);
    keys_->make("vehicle", kVehicle);
    return keys_->folder().string();
  }

  struct Tally {
    double sent = 0.0, missed = 0.0, step_s = 0.0;  // step: mean over the vehicles' newest
  };
  static Tally tally(const std::vector<std::unique_ptr<Vehicle>>& fleet) {
    std::this_thread::sleep_for(600ms);  // the server tells twice a second
    Tally all;
    for (const auto& vehicle : fleet) {
      const auto told = vehicle->told();
      if (!told) continue;
      all.sent += static_cast<double>(told->commands_sent);
      all.missed += static_cast<double>(told->deadlines_missed);
      all.step_s += told->health.solve_time_s / static_cast<double>(fleet.size());
    }
    return all;
  }

  /// States at 100 Hz and frames at 30 Hz of each, evenly over the time.
  static void fly(const std::vector<std::unique_ptr<Vehicle>>& fleet, double length_s) {
    const Stamp period = 10ms;
    const auto rounds = static_cast<std::int64_t>(length_s / seconds(period));
    const auto count = static_cast<std::int64_t>(fleet.size());
    const Stamp begin = now();
    for (std::int64_t turn = 0; turn < rounds * count; ++turn) {
      std::this_thread::sleep_for(begin + turn * period / count - now());
      Vehicle& vehicle = *fleet[static_cast<std::size_t>(turn % count)];
      const Stamp stamp = now();
      const std::int64_t round = turn / count;
      if (round * 3 / 10 != (round + 1) * 3 / 10) vehicle.send_frame(stamp);
      vehicle.send_state(stamp);
    }
  }

  const double length_s_;
  const fs::path folder_;
  Results results_;
  std::unique_ptr<test::Keys> keys_;
};

int run(double length_s, const char* file) {
  Bench bench(length_s);
  bool good = bench.wire_alone("");
  good = bench.wire_alone("in-shared-memory") && good;
  good = bench.wire_alone("in-closed-domain") && good;
  if (fs::exists(beside("gatefield-server"))) {
    good = bench.one_vehicle(false) && good;
    good = bench.one_vehicle(true) && good;
    for (const auto& [count, realtime] : {std::pair(8, false), std::pair(16, false), std::pair(32, false),
                                          std::pair(48, false), std::pair(32, true), std::pair(48, true)})
      good = bench.many_vehicles(count, realtime) && good;
  } else {
    std::fprintf(stderr, "gatefield-dds-bench: %s is not built, its part is not measured\n",
                 beside("gatefield-server").c_str());
  }
  if (file == nullptr) return good ? 0 : 1;
  const Status written = bench.write(file);
  if (!written) std::fprintf(stderr, "gatefield-dds-bench: %s\n", written.error().c_str());
  return good && written ? 0 : 1;
}

}  // namespace
}  // namespace gatefield::bench

int main(int argc, char** argv) {
  using namespace gatefield::bench;
  if (argc == 5 && std::string(argv[1]) == "echo")  // the other process of wire_alone()
    return echo({static_cast<std::uint32_t>(std::atoi(argv[2])), std::string(argv[3]) == "1", argv[4]});
  const double length_s = argc > 1 ? std::atof(argv[1]) : 5.0;
  if (!(length_s >= 1 && length_s <= 600) || argc > 3) {
    std::fprintf(stderr, "usage: gatefield-dds-bench [SECONDS, 1 to 600] [FILE]\n");
    return 2;
  }
  return run(length_s, argc == 3 ? argv[2] : nullptr);
}
