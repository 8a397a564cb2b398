// Many vehicles that want to fly, real servers: those that are admitted fly, the others are told, and two servers share
// them.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sched.h>

#include <algorithm>
#include <atomic>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <mutex>
#include <regex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "common/base/clock.h"
#include "gatefield/sdk/client.h"
#include "tests/integration/race/programs.h"
#include "tests/support/http_page.h"

namespace gatefield::test {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;

/// A vehicle that hovers before a gate that it never shows: states at 100 Hz, no frames.
class Hoverer {
 public:
  /// @param patience   with which it asks until it was told that there is no room; then it asks for as long as it lives
  /// @param far_away   takes only what others leave of the processor, as if it had one of its own
  explicit Hoverer(const std::string& name, std::chrono::milliseconds patience, bool far_away = false)
      : thread_([this, name, patience, far_away] {
          const sched_param none{};
          if (far_away) sched_setscheduler(0, SCHED_IDLE, &none);  // and all threads that this one makes
          fly(name, patience);
        }) {}
  ~Hoverer() {
    stop_ = true;
    thread_.join();
  }

  bool told() const { return told_; }
  bool joined() const { return joined_; }  ///< at some time
  std::uint64_t commands() const { return commands_; }
  std::string words() const {
    const std::lock_guard lock(mutex_);
    return words_;
  }
  /// Whose session it has; empty: none.
  std::string server() const {
    const std::lock_guard lock(mutex_);
    return server_;
  }

 private:
  void fly(const std::string& name, std::chrono::milliseconds patience) {
    sdk::Options options;
    options.domain = own_domain();
    options.vehicle = name;
    options.connect_timeout = patience;
    Waypoint gate;
    gate.p_W = Eigen::Vector3d(8, 0, 1.5);
    gate.direction_W = Eigen::Vector3d::UnitX();
    options.course.waypoints = {gate};
    while (!stop_) {
      auto client = sdk::Client::connect(options, &stop_);
      if (!client.ok()) {
        const std::lock_guard lock(mutex_);
        words_ = client.error();
        told_ = told_ || client.failure().code == ErrorCode::kBusyServer;
        if (told_) options.connect_timeout = 1h;
        continue;
      }
      joined_ = true;
      hover(client.value().get());
    }
  }
  void hover(sdk::Client* client) {
    QuadrotorState state;
    state.p_WB = {0, 0, 1.5};
    state.thrust_n = state.thrust_command_n = hover_thrust_n(QuadrotorModel{});
    for (int i = 0; !stop_; ++i) {
      client->send_state(MonotonicClock().now(), state);
      if (i % 20 == 0) {
        commands_ = client->statistics().commands;
        const std::lock_guard lock(mutex_);
        server_ = client->session().server;
      }
      std::this_thread::sleep_for(10ms);
    }
  }

  std::atomic<bool> stop_{false}, told_{false}, joined_{false};
  std::atomic<std::uint64_t> commands_{0};
  mutable std::mutex mutex_;
  std::string words_, server_;
  std::thread thread_;
};
using Crowd = std::vector<std::unique_ptr<Hoverer>>;

template <typename Is>
std::ptrdiff_t count(const Crowd& crowd, Is&& is) {
  return std::count_if(crowd.begin(), crowd.end(), [&](const auto& one) { return is(*one); });
}
template <typename Condition>
bool wait_until(Condition&& condition, std::chrono::milliseconds limit = 60s) {
  for (const Stamp end = MonotonicClock().now() + limit; MonotonicClock().now() < end;) {
    if (condition()) return true;
    std::this_thread::sleep_for(50ms);
  }
  return false;
}
bool flies(const Hoverer& one) { return one.commands() > 20; }

TEST(Crowd, WhoHasNoRoomIsToldAndWhoHasFlies) {
  Programs programs("crowd");
  Process server = programs.server("server.log", {"--threads", "1", "--utilisation", "0.02", "--max-vehicles", "32"});
  ASSERT_TRUE(server.wait_for_output("ready: server", 60s)) << server.output();
  EXPECT_THAT(server.output(), HasSubstr("cores that a vehicle takes, by profile: onboard 0."));
  Crowd crowd;
  for (int i = 0; i < 5; ++i) crowd.push_back(std::make_unique<Hoverer>("drone-" + std::to_string(i), 4s));
  EXPECT_TRUE(wait_until([&] { return count(crowd, flies) >= 1; })) << server.output();
  EXPECT_TRUE(wait_until([&] { return count(crowd, [](const Hoverer& one) { return one.told(); }) >= 1; }))
      << server.output();
  for (const auto& one : crowd)
    if (one->told()) {
      EXPECT_THAT(one->words(),
                  ::testing::AnyOf(HasSubstr("the server has no room: its "), HasSubstr("no planning server")));
    }
  EXPECT_THAT(server.output(), HasSubstr("refused, the server has no room: its 1 vehicle takes 0."));
}

TEST(Crowd, TwoServersShareTheVehiclesAndStandInForEachOther) {
  Programs programs("share");
  // A busy machine must not close the room: they tell each other all the same how much there is.
  Process first = programs.server("first.log", {"--name", "first", "--utilisation", "0"});
  Process second = programs.server("second.log", {"--name", "second", "--utilisation", "0"});
  ASSERT_TRUE(first.wait_for_output("ready: server", 60s)) << first.output();
  ASSERT_TRUE(second.wait_for_output("ready: server", 60s)) << second.output();
  std::this_thread::sleep_for(1s);  // each hears how the other is
  Crowd crowd;
  for (int i = 0; i < 4; ++i) {
    crowd.push_back(std::make_unique<Hoverer>("drone-" + std::to_string(i), 30s));
    ASSERT_TRUE(wait_until([&] { return flies(*crowd.back()); })) << first.output() << second.output();
  }
  const auto of = [&](const char* name) {
    return count(crowd, [&](const Hoverer& one) { return one.server() == name; });
  };
  EXPECT_TRUE(wait_until([&] { return of("first") >= 1 && of("second") >= 1; }, 10s))
      << of("first") << " and " << of("second");

  first.signal(SIGKILL);
  EXPECT_TRUE(wait_until([&] { return of("second") == 4; })) << second.output();
}

// GATEFIELD_CROWD_RACES sets how many races are flown in the crowd; 10 take tens of minutes. The crowd runs on the
// server's cores, and takes what server and racer leave of them: the discovery of 65 participants alone would fill two.
class CrowdedRaces : public ::testing::Test {
 protected:
  std::string page(const std::string& said) const {
    std::smatch found;
    if (!std::regex_search(said, found, std::regex("metrics: port ([0-9]+)"))) return {};
    return http_page(found[1], "/metrics");
  }
  /// The server has found its measure: nobody came or went for half a minute.
  void wait_until_steady(const Process& server) const {
    const auto turnover = [&] {
      const std::string said = page(server.output());
      return std::pair(figure(said, "gatefield_sessions"), figure(said, "gatefield_sessions_shed_total"));
    };
    auto last = turnover();
    Stamp since = MonotonicClock().now();
    const bool steady = wait_until(
        [&] {
          std::this_thread::sleep_for(1s);
          if (const auto now = turnover(); now != last) {
            last = now;
            since = MonotonicClock().now();
          }
          return MonotonicClock().now() - since > 30s;
        },
        300s);
    std::printf("%.0f vehicles%s, %.0f were sent away\n", last.first, steady ? "" : " and no rest", last.second);
    std::fflush(stdout);
  }
  static double figure(const std::string& page, const std::string& name) {
    const std::size_t at = page.find("\n" + name + " ");
    return at == std::string::npos ? -1.0 : std::strtod(page.c_str() + at + name.size() + 2, nullptr);
  }
};

TEST_F(CrowdedRaces, ARacerWinsAndWhoIsAdmittedIsInTime) {
  const char* const asked = std::getenv("GATEFIELD_CROWD_RACES");
  const int races = asked != nullptr ? std::atoi(asked) : 0;
  if (races == 0) GTEST_SKIP() << "GATEFIELD_CROWD_RACES says how many";
  Programs programs("crowded-races");
  Process server = programs.server(
      "server.log", {"--realtime", "--max-vehicles", "64", "--max-priority", "9", "--metrics", "127.0.0.1:0"});
  ASSERT_TRUE(server.wait_for_output("ready: server", 60s)) << server.output();
  Crowd crowd;
  for (int i = 0; i < 64; ++i) crowd.push_back(std::make_unique<Hoverer>("drone-" + std::to_string(i), 20s, true));
  const auto answered = [&] {
    return count(crowd, [](const Hoverer& one) { return one.told() || one.joined(); }) == 64;
  };
  EXPECT_TRUE(wait_until(answered, 180s));
  wait_until_steady(server);
  int won = 0;
  double ticks = 0.0, late = 0.0;
  for (int i = 0; i < races; ++i) {
    const std::string before = page(server.output());
    Process sim =
        programs.simulator("sim.log", {"--scenario", "circle-0.3m", "--seed", std::to_string(i + 1), "--speed", "7",
                                       "--realtime", "--name", "racer", "--priority", "9", "--connect-timeout", "30"});
    const bool this_won = sim.wait(180s).value_or(-1) == 0;
    const std::string after = page(server.output());
    const auto grown = [&](const std::string& name) { return figure(after, name) - figure(before, name); };
    const double race_late = grown("gatefield_deadlines_missed_total");
    const double race_ticks = grown("gatefield_step_seconds_count") + race_late;
    won += this_won ? 1 : 0;
    late += race_late;
    ticks += race_ticks;
    std::printf("race %d: %s, %.0f vehicles, load %.2f of %.2f cores, %.3f %% of %.0f ticks in time, shed %.0f\n",
                i + 1, this_won ? "won" : "lost", figure(after, "gatefield_sessions"),
                figure(after, "gatefield_load_cores"), figure(after, "gatefield_capacity_cores"),
                100.0 * (1.0 - race_late / std::max(1.0, race_ticks)), race_ticks,
                figure(after, "gatefield_sessions_shed_total"));
    std::fflush(stdout);
    EXPECT_TRUE(this_won) << sim.output();
  }
  const auto told = count(crowd, [](const Hoverer& one) { return one.told(); });
  const auto joined = count(crowd, [](const Hoverer& one) { return one.joined(); });
  std::printf("%d of %d races won; %.3f %% of %.0f ticks in time; of 64 vehicles %td joined and %td were told\n", won,
              races, 100.0 * (1.0 - late / std::max(1.0, ticks)), ticks, joined, told);
  EXPECT_GE(1.0 - late / std::max(1.0, ticks), 0.999);
  EXPECT_EQ(count(crowd, [](const Hoverer& one) { return !one.told() && !one.joined(); }), 0)
      << "each got a place or knows why not";
}

}  // namespace
}  // namespace gatefield::test
