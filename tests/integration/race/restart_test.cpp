// A server that is killed and started again at once, as a supervisor does: how long its vehicles are without it.

#include <gatefield/sdk/client.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "common/base/clock.h"
#include "common/base/statistics.h"
#include "tests/integration/race/programs.h"

namespace gatefield::test {
namespace {

using namespace std::chrono_literals;

/// A vehicle that hovers and listens.
class Listener {
 public:
  explicit Listener(std::unique_ptr<sdk::Client> client) : client_(std::move(client)) {
    state_.p_WB = {0, 0, 1.5};
    state_.thrust_n = state_.thrust_command_n = hover_thrust_n(QuadrotorModel{});
  }
  /// Until a command of another session than before comes. @return when; the limit: none came
  Stamp until_another_session(Stamp limit) {
    const std::uint64_t before = session_;
    while (clock_.now() < limit && session_ == before) tick();
    return clock_.now();
  }
  /// What became of the session since the last call.
  std::vector<sdk::SessionChange> changes() {
    std::vector<sdk::SessionChange> changes;
    while (auto change = client_->session_change()) changes.push_back(std::move(*change));
    return changes;
  }
  void fly(Stamp length) {
    for (const Stamp end = clock_.now() + length; clock_.now() < end;) tick();
  }

 private:
  void tick() {
    client_->send_state(clock_.now(), state_);
    while (const auto command = client_->newest()) session_ = command->session;
    std::this_thread::sleep_for(5ms);
  }
  const MonotonicClock clock_;
  std::unique_ptr<sdk::Client> client_;
  QuadrotorState state_;
  std::uint64_t session_ = 0;
};

// GATEFIELD_RESTARTS=50 is the long check.
TEST(Restart, BringsTheSessionBackSoon) {
  const char* const asked = std::getenv("GATEFIELD_RESTARTS");
  const int restarts = asked != nullptr ? std::max(1, std::atoi(asked)) : 1;
  const MonotonicClock clock;
  Programs programs("restart");
  auto server = std::make_unique<Process>(programs.server("server.log"));
  sdk::Options options;
  options.domain = own_domain();
  options.vehicle = "hoverer";
  options.connect_timeout = 30s;
  options.course.waypoints.emplace_back(Eigen::Vector3d(8, 0, 1.5), Eigen::Vector3d::UnitX());
  auto joined = sdk::Client::connect(options);
  ASSERT_TRUE(joined.ok()) << joined.error() << server->output();
  Listener vehicle(std::move(joined).value());
  vehicle.until_another_session(clock.now() + 10s);

  std::vector<double> gone_s;
  for (int i = 0; i < restarts; ++i) {
    vehicle.fly(700ms + 37ms * (i % 10));
    const Stamp begin = clock.now();
    server->signal(SIGKILL);
    server = std::make_unique<Process>(programs.server("server" + std::to_string(i) + ".log"));
    gone_s.push_back(seconds(vehicle.until_another_session(begin + 20s) - begin));
    EXPECT_LT(gone_s.back(), 10.0) << server->output();
    const auto changes = vehicle.changes();
    ASSERT_EQ(changes.size(), 2u);
    EXPECT_EQ(changes[0].kind, sdk::SessionChange::Kind::kLost);
    EXPECT_EQ(changes[0].why, ErrorCode::kNoAnswer);
    EXPECT_EQ(changes[1].kind, sdk::SessionChange::Kind::kRejoined);
  }
  std::printf("%d restarts: the session was back after p50 %.2f s, p99 %.2f s, %.2f s at the most\n", restarts,
              quantile(gone_s, 0.5), quantile(gone_s, 0.99), *std::max_element(gone_s.begin(), gone_s.end()));
  if (restarts > 1) EXPECT_LE(quantile(gone_s, 0.99), 1.0) << "on a machine with nothing else to do";
}

}  // namespace
}  // namespace gatefield::test
