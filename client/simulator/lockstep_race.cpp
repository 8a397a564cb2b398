#include "client/simulator/lockstep_race.h"

#include <algorithm>

#include "client/simulator/simulated_link.h"

namespace gatefield::simulator {
namespace {

constexpr std::chrono::milliseconds kStopPoll{200};  ///< how long an interrupt may wait
/// In lockstep a server waits for a frame that a state names for a second and then plans without it.
constexpr Stamp kDoubtfulAnswer = std::chrono::milliseconds(900);

class LockstepRace {
 public:
  LockstepRace(const RaceParts& race, Report* report)
      : race_(race),
        report_(*report),
        link_({race.options.link_delay, race.options.link_jitter, race.options.link_loss,
               kLockstepEpoch + SimulatedLink::outage_begin(race.scenario.seed), race.options.link_outage},
              race.scenario.seed) {
    if (race.options.link_outage > Stamp{0})
      report->link_out_at_s = seconds(SimulatedLink::outage_begin(race.scenario.seed));
  }

  void run() {
    make_ready(race_, [] {});
    if (race_.vehicle.decided()) return;
    link_.begin(race_.estimator.estimate(kLockstepEpoch + race_.vehicle.race_time(), race_.vehicle.known()));
    last_answer_ = MonotonicClock().now();
    while (!race_.vehicle.decided()) step();
  }

 private:
  void stop_when_lost() {
    if (race_.firmware != nullptr && !race_.firmware->well()) race_.vehicle.stop(Outcome::kFlightControllerLost);
  }

  /// One millisecond.
  void step() {
    const Stamp race_time = race_.vehicle.race_time();
    const Stamp now = kLockstepEpoch + race_time;
    const QuadrotorState estimate = race_.estimator.estimate(now, race_.vehicle.known());
    link_.remember(estimate);
    race_.vehicle.note(race_.estimator.frame());
    if (const auto frame = race_.shutter.step(now, race_.vehicle.pose())) capture(now, *frame);
    if (race_time >= next_control_) {
      link_.send_state(now);
      next_control_ += control_period_;
    }
    if (const auto state = link_.take_state(now)) ask(now, *state);
    if (race_.stop) race_.vehicle.stop(Outcome::kInterrupted);
    if (race_.vehicle.decided()) return;
    race_.vehicle.advance(race_.client.play(now, estimate, Plant::kStep));
    stop_when_lost();
    if (race_.on_progress && race_time >= next_progress_) {
      race_.on_progress(race_.vehicle.progress());
      next_progress_ += kProgressPeriod;
    }
  }

  void capture(Stamp now, const Shutter::Frame& frame) {
    const scene::DepthImage& image = race_.sensor.capture(frame.poses());
    race_.snapshots.offer(image, frame.middle(), race_.vehicle.expected_waypoint(), race_.vehicle.passes(),
                          seconds(race_.vehicle.race_time()));
    link_.send_frame(now, frame.stamp, image, race_.sensor.counts());
  }

  /// Sends the frames that are there by now and the state, and waits for the answer.
  void ask(Stamp now, const SimulatedLink::State& state) {
    while (const auto frame = link_.take_frame(now)) {
      ++report_.frames_sent;
      if (race_.options.depth_in_counts) {
        race_.client.send_depth_counts(frame->stamp, frame->counts);
      } else {
        race_.client.send_depth(frame->stamp, frame->metres.depth_m);
      }
    }
    const std::uint64_t sequence = race_.client.send_state(state.stamp, state.state, race_.vehicle.thrust_known());
    ++report_.control_ticks;
    if (answered(sequence)) {
      last_answer_ = MonotonicClock().now();
    } else if (!race_.stop) {
      ++report_.late_ticks;
      if (MonotonicClock().now() - last_answer_ > race_.options.give_up) race_.vehicle.stop(Outcome::kLinkLost);
    }
    race_.news.listen(seconds(race_.vehicle.race_time()));
  }

  /// True when the answer came; false after the timeout or on interrupt.
  bool answered(std::uint64_t sequence) {
    const Stamp sent = MonotonicClock().now();
    const auto timeout = race_.options.answer_timeout;
    for (auto waited = std::chrono::milliseconds(0); waited < timeout && !race_.stop; waited += kStopPoll) {
      const auto command = race_.client.wait_for_answer(sequence, std::min(kStopPoll, timeout - waited));
      if (!command) continue;
      race_.vehicle.note(command->health);
      if (command->health.degraded && MonotonicClock().now() - sent > kDoubtfulAnswer) ++report_.doubtful_ticks;
      return true;
    }
    return false;
  }

  const RaceParts& race_;
  Report& report_;
  SimulatedLink link_;
  const Stamp control_period_ =
      std::max(Plant::kStep, from_seconds(race_.client.session().control_period_s) / Plant::kStep * Plant::kStep);
  Stamp next_control_{0}, next_progress_{0};
  Stamp last_answer_{0};
};

}  // namespace

void run_lockstep(const RaceParts& race, Report* report) { LockstepRace(race, report).run(); }

}  // namespace gatefield::simulator
