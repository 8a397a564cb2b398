// A pilot's three sides on three threads. Run under ThreadSanitizer as well; the waits are long enough for that.

#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "tests/unit/server/pilot/fakes.h"

namespace gatefield::pilot {
namespace {

using namespace std::chrono_literals;

void fly(protocol::Timing timing) {
  constexpr std::uint64_t kStates = 300;
  testing::Bench bench(timing);
  Pilot& pilot = *bench.pilot;
  const MonotonicClock clock;
  std::atomic<bool> flying{true};
  std::atomic<std::uint64_t> answered{0};
  const bool lockstep = timing == protocol::Timing::kLockstep;

  std::thread perception([&] {
    while (flying) {
      if (pilot.looking().due()) pilot.looking().look();
      std::this_thread::yield();
    }
  });
  std::thread control([&] {
    std::uint64_t last = 0;
    while (flying) {
      const Stamp begin = clock.now();
      const Stepping::Answer answer = pilot.stepping().step(begin);
      if (answer.command) {
        // In lockstep a state that comes again while it is planned for is answered again, with the same command.
        const bool again = lockstep && answer.command->sequence == last;
        EXPECT_TRUE(again || answer.command->sequence == last + 1) << answer.command->sequence << " after " << last;
        last = answer.command->sequence;
        pilot.stepping().solved(clock.now() - begin);
        pilot.stepping().sent(clock.now(), true);
        answered = answer.command->answers_sequence;
      }
      std::this_thread::yield();
    }
  });
  std::thread people([&] {
    protocol::Telemetry telemetry;
    while (flying) {
      pilot.fill(clock.now(), &telemetry);
      pilot.complaints();
      pilot.problems();
      std::this_thread::sleep_for(1ms);
    }
  });
  const Stamp end = clock.now() + 60s;
  for (std::uint64_t i = 1; i <= kStates && clock.now() < end; ++i) {
    const bool restarted = i > kStates / 2;  // the vehicle's clock
    const Stamp stamp = (restarted ? 0s : 50s) + static_cast<std::int64_t>(i) * 10ms;
    auto frame = testing::depth_frame(bench.request, testing::Bench::kId, i, stamp);
    auto state = testing::hover_state("drone", testing::Bench::kId, i, stamp, {0.04 * static_cast<double>(i), 0, 1.5});
    state.depth_sequence = i;
    pilot.intake().take_depth(frame, clock.now());
    if (i % 17 == 0) pilot.intake().note_rejected_frame(Error("encoding is 9, expected 0 or 1"));
    if (i % 40 == 0) {
      auto hostile = state;
      hostile.stamp = TimeLine::kMaxStamp;
      pilot.intake().take_state(hostile, clock.now());
    }
    const Intake::Outcome outcome = pilot.intake().take_state(state, clock.now());
    if (!lockstep && outcome == Intake::Outcome::kRejected) continue;  // the first ones of the new time line
    while (answered < i && clock.now() < end) {
      if (outcome == Intake::Outcome::kRejected) pilot.intake().take_state(state, clock.now());
      std::this_thread::yield();
    }
    if (!lockstep) std::this_thread::sleep_for(200us);  // some ticks without news
  }
  flying = false;
  perception.join();
  control.join();
  people.join();
  EXPECT_EQ(answered, kStates);
  EXPECT_GE(bench.planner->plans, kStates);
  EXPECT_TRUE(bench.saw(0));
  EXPECT_EQ(pilot.stepping().progress().target(), 2u);  // flew through two gates
}

TEST(PilotThreads, LockstepWithEachSideOnAThreadOfItsOwn) { fly(protocol::Timing::kLockstep); }
TEST(PilotThreads, RealTimeWithEachSideOnAThreadOfItsOwn) { fly(protocol::Timing::kRealTime); }

}  // namespace
}  // namespace gatefield::pilot
