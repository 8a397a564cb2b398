// Control threads that help each other: what comes out doesn't depend on how many there are. Also run under
// ThreadSanitizer.

#include <gtest/gtest.h>

#include <atomic>
#include <map>
#include <thread>

#include "server/service/workers.h"
#include "tests/unit/server/service/fakes.h"

namespace gatefield::service {
namespace {

using namespace std::chrono_literals;

using Rates = std::vector<double>;

/// Two vehicles in lockstep with real planners. @return every command's first thrust rates, by session and sequence
std::map<std::pair<std::uint64_t, std::uint64_t>, Rates> fly(int threads) {
  constexpr std::uint64_t kStates = 15;
  kernels::Crew crew(threads);
  const MonotonicClock clock;
  testing::FakeTransport transport;
  ControlPool pool({threads, false, &crew, {}}, &clock, &transport);
  EXPECT_EQ(pool.complaint(), "");
  std::vector<std::shared_ptr<pilot::Pilot>> pilots;
  for (std::uint64_t id = 1; id <= 2; ++id) {
    planner::Profile profile = testing::small_profile();
    profile.samples = 512;
    pilot::PilotParts parts;
    parts.request = testing::join_request("drone" + std::to_string(id), 7, protocol::Timing::kLockstep);
    parts.session = id;
    auto planner = planner::Planner::create(profile, parts.request.quadrotor, parts.request.course, kGuideConeAngle_rad,
                                            id, {.crew = &crew});
    EXPECT_TRUE(planner.ok());
    parts.planner = std::move(planner).value();
    parts.sensor = std::make_unique<testing::FakeSensor>();
    parts.isa = "any";
    parts.now = clock.now();
    pilots.push_back(std::make_shared<pilot::Pilot>(std::move(parts)));
    pool.add(pilots.back());
  }
  for (std::uint64_t i = 1; i <= kStates; ++i) {
    for (const auto& pilot : pilots) {
      pilot->intake().take_state(
          testing::hover_state(pilot->vehicle(), pilot->session(), i, 50s + static_cast<std::int64_t>(i) * 20ms,
                               {0.1 * static_cast<double>(i), 0, 1.5}),
          clock.now());
      pool.wake(pilot.get());
    }
    const auto end = clock.now() + 10s;
    while (transport.command_count() < 2 * i && clock.now() < end) std::this_thread::sleep_for(100us);
  }
  for (const auto& pilot : pilots) pool.remove(pilot.get());
  std::map<std::pair<std::uint64_t, std::uint64_t>, Rates> rates;
  for (const auto& command : transport.commands()) {
    const auto& u = command.thrust_rate_n_s[0];
    rates[{command.session, command.answers_sequence}] = {u[0], u[1], u[2], u[3]};
  }
  EXPECT_EQ(rates.size(), 2 * kStates);
  return rates;
}

TEST(ControlPool, CommandsAreTheSameBitForBitWhateverTheNumberOfThreads) {
  const auto one = fly(1);
  EXPECT_EQ(one, fly(2));
  EXPECT_EQ(one, fly(3));
}

TEST(ControlPool, ADeedBetweenTwoStepsMeetsNone) {
  const MonotonicClock clock;
  testing::FakeTransport transport;
  ControlPool pool({2, false, nullptr, {}}, &clock, &transport);
  auto script = std::make_shared<testing::FakePlanner::Script>();
  std::atomic<bool> planning{false};
  script->during = [&] {
    planning = true;
    std::this_thread::sleep_for(1ms);
    planning = false;
  };
  pilot::PilotParts parts;
  parts.request = testing::join_request();
  parts.session = 1;
  parts.planner = std::make_unique<testing::FakePlanner>(testing::small_profile(), parts.request.quadrotor, script);
  parts.sensor = std::make_unique<testing::FakeSensor>();
  parts.now = clock.now();
  const auto pilot = std::make_shared<pilot::Pilot>(std::move(parts));
  EXPECT_FALSE(pool.between_steps(pilot.get(), [] { FAIL() << "not served here"; }));
  pool.add(pilot);
  int deeds = 0;
  for (std::uint64_t i = 1; i <= 50; ++i) {
    pilot->intake().take_state(testing::hover_state("drone", 1, i, 50s + static_cast<std::int64_t>(i) * 20ms),
                               clock.now());
    EXPECT_TRUE(pool.between_steps(pilot.get(), [&] {
      ++deeds;
      EXPECT_FALSE(planning);
      EXPECT_FALSE(pilot->save().empty());
      EXPECT_FALSE(planning);
    }));
    std::this_thread::sleep_for(3ms);
  }
  EXPECT_EQ(deeds, 50);
  EXPECT_GT(transport.command_count(), 2u) << "steps go on";
  pool.remove(pilot.get());
  EXPECT_FALSE(pool.between_steps(pilot.get(), [] { FAIL() << "served no more"; }));
}

TEST(ControlPool, SaysWhichCoreItDidNotGet) {
  const MonotonicClock clock;
  testing::FakeTransport transport;
  const ControlPool pool({1, false, nullptr, {100000}}, &clock, &transport);
  EXPECT_NE(pool.complaint().find("control thread 0 was not bound to core 100000"), std::string::npos)
      << pool.complaint();
}

}  // namespace
}  // namespace gatefield::service
