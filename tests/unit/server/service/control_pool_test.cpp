// Control threads that help each other: what comes out doesn't depend on how many there are. Also run under
// ThreadSanitizer.

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "server/service/processor_time.h"
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

/// Pilots on fakes that write down whose step is made, and may hold it up.
class Steps {
 public:
  std::shared_ptr<pilot::Pilot> pilot(std::uint64_t id, protocol::Timing timing, const std::function<void()>& during) {
    const auto script = std::make_shared<testing::FakePlanner::Script>();
    script->during = [this, id, during] {
      {
        const std::lock_guard lock(mutex_);
        made_.push_back(id);
      }
      if (during) during();
    };
    pilot::PilotParts parts;
    parts.request = testing::join_request("drone" + std::to_string(id), 7, timing);
    parts.session = id;
    parts.planner = std::make_unique<testing::FakePlanner>(testing::small_profile(), parts.request.quadrotor, script);
    parts.sensor = std::make_unique<testing::FakeSensor>();
    parts.isa = "any";
    parts.now = clock_.now();
    auto made = std::make_shared<pilot::Pilot>(std::move(parts));
    feed(made.get(), 1);
    return made;
  }
  void feed(pilot::Pilot* pilot, std::uint64_t sequence) const {
    pilot->intake().take_state(
        testing::hover_state(pilot->vehicle(), pilot->session(), sequence, 50s + Stamp(10ms) * sequence), clock_.now());
  }
  std::vector<std::uint64_t> made() const {
    const std::lock_guard lock(mutex_);
    return made_;
  }
  bool wait(std::size_t count) const {
    for (const Stamp end = clock_.now() + 20s; clock_.now() < end && made().size() < count;)
      std::this_thread::sleep_for(100us);
    return made().size() >= count;
  }

 private:
  const MonotonicClock clock_{};
  mutable std::mutex mutex_;
  std::vector<std::uint64_t> made_;
};

TEST(ControlPool, LockstepIsServedAfterAllThatHaveDeadlines) {
  const MonotonicClock clock;
  testing::FakeTransport transport;
  Steps steps;
  std::atomic<bool> go{false};
  const auto first = steps.pilot(1, protocol::Timing::kLockstep, [&] {
    for (const Stamp end = clock.now() + 20s; !go && clock.now() < end;) std::this_thread::sleep_for(100us);
  });
  const auto lockstep = steps.pilot(2, protocol::Timing::kLockstep, {});
  ControlPool pool({1, false, nullptr, {}}, &clock, &transport);
  for (const auto& pilot : {first, lockstep}) pool.add(pilot);
  pool.wake(first.get());
  ASSERT_TRUE(steps.wait(1));
  pool.wake(lockstep.get());  // while the only thread is busy: due before the one that comes now
  const auto real_time = steps.pilot(3, protocol::Timing::kRealTime, {});
  pool.add(real_time);
  go = true;
  ASSERT_TRUE(steps.wait(3));
  EXPECT_EQ(steps.made()[0], 1u);
  EXPECT_EQ(steps.made()[1], 3u);
}

TEST(ControlPool, OneThreadIsKeptForThoseThatHaveDeadlines) {
  const MonotonicClock clock;
  testing::FakeTransport transport;
  Steps steps;
  std::atomic<bool> go{false};
  const auto hold = [&] {
    for (const Stamp end = clock.now() + 20s; !go && clock.now() < end;) std::this_thread::sleep_for(100us);
  };
  const auto real_time = steps.pilot(3, protocol::Timing::kRealTime, {});
  const auto first = steps.pilot(1, protocol::Timing::kLockstep, hold);
  const auto second = steps.pilot(2, protocol::Timing::kLockstep, hold);
  ControlPool pool({2, false, nullptr, {}}, &clock, &transport);
  pool.add(real_time);
  for (const auto& pilot : {first, second}) {
    pool.add(pilot);
    pool.wake(pilot.get());
  }
  // One lockstep step holds a thread; the other thread goes on with the real-time pilot alone.
  std::uint64_t sequence = 1;
  for (const Stamp limit = clock.now() + 20s; steps.made().size() < 10 && clock.now() < limit;) {
    steps.feed(real_time.get(), ++sequence);
    std::this_thread::sleep_for(10ms);
  }
  const auto made = steps.made();
  EXPECT_GE(made.size(), 10u);
  EXPECT_EQ(std::ranges::count(made, 1u) + std::ranges::count(made, 2u), 1);
  go = true;
  const Stamp end = clock.now() + 20s;
  const auto both = [&] {
    const auto now = steps.made();
    return std::ranges::count(now, 1u) > 0 && std::ranges::count(now, 2u) > 0;
  };
  while (!both() && clock.now() < end) std::this_thread::sleep_for(1ms);
  EXPECT_TRUE(both()) << "and the other one gets its turn";
}

TEST(ControlPool, WhoWaitedForLongAndIsInTimeIsCounted) {
  const MonotonicClock clock;
  testing::FakeTransport transport;
  Steps steps;
  const auto period = steps.pilot(9, protocol::Timing::kRealTime, {})->control_period();
  const auto slow = steps.pilot(1, protocol::Timing::kRealTime, [&] { std::this_thread::sleep_for(1.2 * period); });
  const auto waits = steps.pilot(2, protocol::Timing::kRealTime, {});
  ControlPool pool({1, false, nullptr, {}}, &clock, &transport);
  pool.add(slow);
  pool.add(waits);  // due half a period after the other one, which ends 0.7 periods later
  std::uint64_t sequence = 1;
  const auto narrow = [&] { return waits->account().ticks_narrow.load(); };
  for (const Stamp end = clock.now() + 20s; narrow() < 3 && clock.now() < end;) {
    ++sequence;
    for (const auto& pilot : {slow, waits}) steps.feed(pilot.get(), sequence);
    std::this_thread::sleep_for(period / 4);
  }
  EXPECT_GE(narrow(), 3u);
  EXPECT_EQ(slow->account().ticks_narrow.load(), 0u) << "it waits for nobody, and is late by itself";
}

TEST(ControlPool, ProcessorTimeOfStepsIsCounted) {
  const MonotonicClock clock;
  testing::FakeTransport transport;
  Steps steps;
  const auto pilot = steps.pilot(1, protocol::Timing::kLockstep, [] {
    const auto begin = processor_time_of_thread();
    while (processor_time_of_thread() - begin < 5ms) continue;
  });
  ControlPool pool({1, false, nullptr, {}}, &clock, &transport);
  pool.add(pilot);
  pool.wake(pilot.get());
  ASSERT_TRUE(steps.wait(1));
  pool.remove(pilot.get());
  EXPECT_GE(pilot->account().step_cpu_ns.load(), 5'000'000);
  EXPECT_GE(pool.spent().all, 5ms);
  EXPECT_EQ(pool.spent().helping, 0ns);
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
