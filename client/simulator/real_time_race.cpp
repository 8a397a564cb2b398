#include "client/simulator/real_time_race.h"

#include <algorithm>

#include "client/flight/doorbell.h"
#include "client/flight/loop.h"
#include "common/base/mailbox.h"

namespace gatefield::simulator {
namespace {

constexpr Stamp kMadeUpFor = std::chrono::milliseconds(20);  // of steps that are late while a firmware gets ready

/// Renders what the plant's thread posts, on the thread that waits for frames; only the newest is done.
class SimulatedCamera final : public flight::DepthSource {
 public:
  explicit SimulatedCamera(const RaceParts& race) : race_(race) {}

  /// On the plant's thread.
  void post(const Shutter::Frame& frame) {
    jobs_.slot() = {frame, race_.vehicle.passes(), race_.vehicle.progress()};
    jobs_.publish();
    ++posted_;
    bell_.ring();
  }
  /// @pre the thread that takes frames has ended
  std::uint64_t posted() const noexcept { return posted_; }

  std::optional<flight::DepthFrame> next(std::chrono::nanoseconds timeout) override {
    if (!bell_.wait_for(timeout)) return std::nullopt;
    const Job* job = jobs_.read();
    if (job == nullptr) return std::nullopt;  // it was taken with the ring before
    const scene::DepthImage& image = race_.sensor.capture(job->frame.poses());
    race_.snapshots.offer(image, job->frame.middle(), job->progress.gate, job->passes, job->progress.race_time_s);
    if (job->frame.stamp >= next_progress_) {
      race_.news.listen(job->progress.race_time_s);
      if (race_.on_progress) race_.on_progress(job->progress);
      next_progress_ = job->frame.stamp + kProgressPeriod;
    }
    if (race_.options.depth_in_counts)
      return flight::DepthFrame{job->frame.stamp, std::span<const std::uint16_t>(race_.sensor.counts())};
    return flight::DepthFrame{job->frame.stamp, std::span<const float>(image.depth_m)};
  }

 private:
  struct Job {
    Shutter::Frame frame;
    std::size_t passes = 0;
    Progress progress;
  };

  const RaceParts& race_;
  Mailbox<Job> jobs_;
  flight::Doorbell bell_;
  std::uint64_t posted_ = 0;  // the plant's thread's
  Stamp next_progress_{0};    // the other thread's
};

/// The plant as the loop's vehicle. It stays at the start until the first plan is there; then the race's clock starts.
class SimulatedVehicle final : public flight::StateSource, public flight::Actuator, public flight::Observer {
 public:
  SimulatedVehicle(const RaceParts& race, SimulatedCamera* camera) : race_(race), camera_(*camera) {}

  std::optional<flight::TimedState> newest(Stamp now) noexcept override {
    if (const auto frame = race_.shutter.step(now, race_.vehicle.pose())) camera_.post(*frame);
    const QuadrotorState estimate = race_.estimator.estimate(now, race_.vehicle.known());
    race_.vehicle.note(race_.estimator.frame());
    return flight::TimedState{now, estimate, race_.vehicle.thrust_known()};
  }

  flight::SetpointPart accepts() const noexcept override {
    return race_.scenario.vehicle.actuation.kind == Actuation::Kind::kBodyRates
               ? flight::SetpointPart::kCollectiveAndBodyRates
               : flight::SetpointPart::kRotorThrustRates;
  }
  Stamp period() const noexcept override { return Plant::kStep; }
  void apply(Stamp, const sdk::Setpoint& setpoint) noexcept override { race_.vehicle.advance(setpoint); }
  void hold(Stamp) noexcept override {
    if (race_.firmware != nullptr) race_.firmware->stand(race_.vehicle.truth());
  }

  void on_plan(const protocol::ThrustRateCommand& plan) noexcept override { race_.vehicle.note(plan.health); }
  bool goes_on() noexcept override { return !race_.vehicle.decided() && well(); }

 private:
  bool well() const noexcept { return race_.firmware == nullptr || race_.firmware->well(); }

  const RaceParts& race_;
  SimulatedCamera& camera_;
};

}  // namespace

void run_real_time(const RaceParts& race, Report* report) {
  flight::RealTimeClock clock;
  // No state is told before a firmware hovers: plans would be for a vehicle that does not follow.
  Stamp step = clock.now();
  make_ready(race, [&] { clock.sleep_until(step = std::max(step + Plant::kStep, clock.now() - kMadeUpFor)); });
  if (race.vehicle.decided()) return;
  SimulatedCamera camera(race);
  SimulatedVehicle vehicle(race, &camera);
  flight::LoopOptions options;
  options.state_rate_hz = race.options.state_rate_hz;
  options.give_up = race.options.give_up;
  const flight::LoopStatistics loop =
      flight::run_loop({&vehicle, &camera, &vehicle, &vehicle}, &race.client, options, &clock, race.stop);
  if (loop.end == flight::End::kGivenUp) race.vehicle.stop(Outcome::kLinkLost);
  if (loop.end == flight::End::kStopped) race.vehicle.stop(Outcome::kInterrupted);
  if (race.firmware != nullptr && !race.firmware->well()) race.vehicle.stop(Outcome::kFlightControllerLost);

  report->control_ticks = loop.control_periods;
  report->late_ticks = loop.periods_without_plan;
  report->frames_sent = loop.frames_sent;
  report->frames_skipped = camera.posted() > loop.frames_sent ? camera.posted() - loop.frames_sent : 0;
  report->loop_steps = loop.steps;
  report->loop_misses = loop.late_steps;
  report->loop_worst_s = seconds(loop.worst_late);
}

}  // namespace gatefield::simulator
