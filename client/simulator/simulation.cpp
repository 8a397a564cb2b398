#include "client/simulator/simulation.h"

#include <time.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <thread>

#include "client/simulator/depth_sensor.h"
#include "client/simulator/plant.h"
#include "common/base/mailbox.h"
#include "common/base/random.h"

namespace gatefield::simulator {
namespace {

using protocol::Timing;

constexpr Stamp kSamplePeriod = std::chrono::milliseconds(10);
constexpr std::chrono::milliseconds kStopPoll{200};  ///< how long an interrupt may wait
/// In lockstep a server waits for a frame that a state names for a second and then plans without it.
constexpr Stamp kDoubtfulAnswer = std::chrono::milliseconds(900);
constexpr Stamp kLoopTolerance = std::chrono::milliseconds(1);
constexpr Stamp kLoopSlip =
    std::chrono::milliseconds(250);  ///< farther behind than this, real time is not caught up with any more

Eigen::Isometry3d pose_of(const QuadrotorState& state) {
  Eigen::Isometry3d X_WB = Eigen::Isometry3d::Identity();
  X_WB.linear() = state.q_WB.toRotationMatrix();
  X_WB.translation() = state.p_WB;
  return X_WB;
}

/// What the vehicle believes about itself: the truth with the estimator's error.
class Estimator {
 public:
  Estimator(const config::StateNoise& noise, std::uint64_t seed)
      : noise_(noise), random_(seed, static_cast<std::uint64_t>(config::Stream::kStateNoise)) {}

  QuadrotorState estimate(const QuadrotorState& truth) {
    QuadrotorState state = truth;
    state.p_WB += error(noise_.position_m);
    state.v_WB += error(noise_.velocity_m_s);
    const Eigen::Vector3d turn_B = error(noise_.attitude_rad);
    if (turn_B.norm() > 0)
      state.q_WB = (state.q_WB * Eigen::AngleAxisd(turn_B.norm(), turn_B.normalized())).normalized();
    state.w_WB_B += error(noise_.rate_rad_s);
    return state;
  }

 private:
  Eigen::Vector3d error(double sigma) {
    if (sigma == 0.0) return Eigen::Vector3d::Zero();
    const double x = random_.normal(), y = random_.normal(), z = random_.normal();
    return sigma * Eigen::Vector3d(x, y, z);
  }

  config::StateNoise noise_;
  Random random_;
};

/// Keeps the frame that shows best what the planner works from: a gate in full view a few metres ahead, on the way and
/// not at the start.
class SnapshotKeeper {
 public:
  SnapshotKeeper(const scene::World& world, const CameraModel& camera) : world_(world), camera_(camera) {}

  void offer(const scene::DepthImage& depth, const Eigen::Isometry3d& X_WB, int gate, std::size_t passes, double t_s) {
    const Eigen::Isometry3d X_WC = X_WB * camera_.X_BC;
    const Eigen::Vector3d p_CG = X_WC.inverse() * world_.gates[static_cast<std::size_t>(gate)].X_WG.translation();
    const bool visible = camera_.sees(p_CG, 0.15 * camera_.height_px);
    const double off_m = std::abs(p_CG.z() - kBestDistance_m);
    const int rank = !visible ? 0 : off_m > 1.0 ? 1 : passes == 0 ? 2 : 3;
    if (rank < rank_ || (rank == rank_ && off_m >= off_m_)) return;
    rank_ = rank;
    off_m_ = off_m;
    kept_ = Snapshot{depth, camera_, X_WC, gate, t_s};
  }

  std::optional<Snapshot> take() { return std::move(kept_); }

 private:
  const scene::World& world_;
  CameraModel camera_;
  static constexpr double kBestDistance_m = 3.5;
  int rank_ = -1;
  double off_m_ = 0.0;
  std::optional<Snapshot> kept_;
};

class Race {
 public:
  Race(const config::Scenario& scenario, const Options& options, sdk::Client* client, const std::atomic<bool>& stop,
       const ProgressFunction& on_progress, scene::World world, std::unique_ptr<Plant> plant)
      : scenario_(scenario),
        options_(options),
        client_(*client),
        stop_(stop),
        on_progress_(on_progress),
        world_(std::move(world)),
        plant_(std::move(plant)),
        sensor_(world_, scenario),
        estimator_(scenario.state_noise, scenario.seed),
        snapshots_(world_, scenario.vehicle.camera),
        referee_(world_, rules(), start_state(scenario).p_WB),
        link_(scenario.seed, static_cast<std::uint64_t>(config::Stream::kLink)) {
    plant_->set_state(start_state(scenario));
    control_period_ = std::max(Plant::kStep, from_seconds(client_.session().control_period_s));
    // room beforehand, so that the plant's thread does not allocate in races of up to five minutes
    report_.samples.reserve(
        static_cast<std::size_t>(std::min<Stamp>(scenario.time_limit, std::chrono::minutes(5)) / kSamplePeriod) + 2);
  }

  Report run() {
    const Stamp begin = MonotonicClock().now();
    if (options_.timing == Timing::kLockstep) {
      run_lockstep();
    } else {
      run_real_time();
    }
    report_.wall_s = seconds(MonotonicClock().now() - begin);
    finish();
    return std::move(report_);
  }

 private:
  Rules rules() const {
    Rules rules;
    rules.laps = scenario_.track.course.laps;
    rules.flight_volume = scenario_.track.flight_volume;
    rules.vehicle_radius_m = scenario_.vehicle.quadrotor.collision_radius_m;
    rules.time_limit = scenario_.time_limit;
    return rules;
  }

  Stamp frame_period() const { return from_seconds(1.0 / scenario_.vehicle.camera.rate_hz); }

  std::uint64_t send(Stamp stamp, const scene::DepthImage& image) {
    ++frames_sent_;
    return options_.depth_in_millimetres ? client_.send_depth_mm(stamp, sensor_.millimetres())
                                         : client_.send_depth(stamp, image.depth_m);
  }

  Progress progress(Stamp race_time) const {
    return {seconds(race_time),
            referee_.lap(),
            scenario_.track.course.laps,
            referee_.expected_gate(),
            static_cast<int>(world_.gates.size()),
            plant_->state().v_WB.norm()};
  }

  /// One millisecond of the vehicle under the plan, seen by the referee and the log.
  void advance(Stamp now, Stamp race_time, const QuadrotorState& estimate) {
    const sdk::Setpoint setpoint = client_.play(now, estimate, Plant::kStep);
    if (setpoint.source == sdk::Setpoint::Source::kFallback) report_.fallback_s += seconds(Plant::kStep);
    if (race_time % kSamplePeriod == Stamp{0}) record(race_time, setpoint);
    plant_->step(setpoint.thrust_rate_n_s);
    const QuadrotorState& state = plant_->state();
    const double speed_m_s = state.v_WB.norm();
    report_.top_speed_m_s = std::max(report_.top_speed_m_s, speed_m_s);
    distance_m_ += speed_m_s * seconds(Plant::kStep);
    referee_.update(race_time + Plant::kStep, state.p_WB, state.v_WB, plant_->contact());
    last_setpoint_ = setpoint;
  }

  void record(Stamp race_time, const sdk::Setpoint& setpoint) {
    report_.samples.push_back(
        {seconds(race_time), plant_->state(), setpoint, referee_.expected_gate(), referee_.lap(), health_});
  }

  // --- lockstep ---

  /// A state that the planner will see, and when its answer will be there.
  struct State {
    Stamp stamp;
    Stamp arrival;
    QuadrotorState state;
  };
  struct Frame {
    Stamp stamp;
    Stamp arrival;  // on the vehicle's own time scale
    scene::DepthImage metres;
    std::vector<std::uint16_t> millimetres;
  };

  /// A message on its way to the planner (and, of a state, the plan on its way back).
  struct Passage {
    bool lost = false;
    Stamp jitter{0};
  };

  /// The draws of a message do not depend on what becomes of it, so that the next one's are the same in any case.
  Passage pass_link(int ways) {
    Passage passage;
    for (int way = 0; way < ways; ++way) passage.lost = link_.uniform() < options_.link_loss || passage.lost;
    passage.jitter =
        Plant::kStep * std::llround(link_.uniform() * seconds(options_.link_jitter) / seconds(Plant::kStep));
    return passage;
  }

  void keep_frame(Stamp now, const scene::DepthImage& image) {
    const Passage passage = pass_link(1);
    if (passage.lost) return;
    frames_.push_back({now, now + options_.link_delay + passage.jitter, image, sensor_.millimetres()});
  }

  /// Sends what has arrived by now, older frames first; those that a newer one has overtaken are lost.
  void send_due_frames(Stamp now) {
    for (std::size_t i = 0; i < frames_.size();) {
      if (frames_[i].arrival > now) {
        ++i;
        continue;
      }
      const Frame frame = std::move(frames_[i]);
      frames_.erase(frames_.begin(), frames_.begin() + static_cast<std::ptrdiff_t>(i) + 1);
      i = 0;
      ++frames_sent_;
      if (options_.depth_in_millimetres) {
        client_.send_depth_mm(frame.stamp, frame.millimetres);
      } else {
        client_.send_depth(frame.stamp, frame.metres.depth_m);
      }
    }
  }

  /// True when the answer came; false after the timeout or on interrupt.
  bool answered(std::uint64_t sequence) {
    const Stamp sent = MonotonicClock().now();
    for (auto waited = std::chrono::milliseconds(0); waited < options_.answer_timeout && !stop_; waited += kStopPoll) {
      const auto command = client_.wait_for_answer(sequence, std::min(kStopPoll, options_.answer_timeout - waited));
      if (command) {
        health_ = command->health;
        if (health_.degraded && MonotonicClock().now() - sent > kDoubtfulAnswer) ++report_.doubtful_ticks;
        return true;
      }
    }
    return false;
  }

  void run_lockstep() {
    const auto delay_steps = static_cast<std::size_t>(options_.link_delay / Plant::kStep);
    std::deque<QuadrotorState> past(delay_steps + 1,
                                    estimator_.estimate(plant_->state()));  // front: what the planner sees now
    const Stamp control_period = std::max(Plant::kStep, control_period_ / Plant::kStep * Plant::kStep);
    Stamp next_control{0}, next_frame{0}, next_progress{0};
    Stamp last_answer = MonotonicClock().now();

    for (Stamp race_time{0}; !referee_.decided(); race_time += Plant::kStep) {
      const Stamp now = kLockstepEpoch + race_time;
      const QuadrotorState estimate = estimator_.estimate(plant_->state());
      past.pop_front();
      past.push_back(estimate);

      if (race_time >= next_frame) {
        const Eigen::Isometry3d X_WB = pose_of(plant_->state());
        const scene::DepthImage& image = sensor_.capture(X_WB);
        snapshots_.offer(image, X_WB, referee_.expected_gate(), referee_.passes().size(), seconds(race_time));
        keep_frame(now, image);
        next_frame += frame_period();
      }
      if (race_time >= next_control) {
        const Passage passage = pass_link(2);
        if (!passage.lost) states_.push_back({now - options_.link_delay, now + passage.jitter, past.front()});
        next_control += control_period;
      }
      // Of the states that are there by now the newest counts; it has overtaken the others.
      std::size_t arrived = states_.size();
      while (arrived > 0 && states_[arrived - 1].arrival > now) --arrived;
      if (arrived > 0) {
        send_due_frames(now);
        const std::uint64_t sequence = client_.send_state(states_[arrived - 1].stamp, states_[arrived - 1].state);
        states_.erase(states_.begin(), states_.begin() + static_cast<std::ptrdiff_t>(arrived));
        ++report_.control_ticks;
        if (answered(sequence)) {
          last_answer = MonotonicClock().now();
        } else if (!stop_) {
          ++report_.late_ticks;
          if (MonotonicClock().now() - last_answer > options_.give_up) referee_.stop(Outcome::kLinkLost, race_time);
        }
      }
      if (stop_) referee_.stop(Outcome::kInterrupted, race_time);
      if (referee_.decided()) break;
      advance(now, race_time, estimate);
      if (on_progress_ && race_time >= next_progress) {
        on_progress_(progress(race_time));
        next_progress += std::chrono::milliseconds(100);
      }
    }
  }

  // --- real time ---

  struct FrameJob {
    Stamp stamp{0};
    Stamp race_time{0};
    Eigen::Isometry3d X_WB = Eigen::Isometry3d::Identity();
    int gate = 0;
    std::size_t passes = 0;
    Progress progress;
  };

  /// Renders and sends what the plant's thread posts. `posted_` counts the jobs and wakes this thread; only the newest
  /// job is done.
  void run_camera() {
    Stamp next_progress{0};
    for (std::uint32_t seen = 0;;) {
      posted_.wait(seen);
      const std::uint32_t posted = posted_.load();
      if (posted == kCameraEnd) return;
      seen = posted;
      const FrameJob* job = jobs_.read();
      if (job == nullptr) continue;  // a newer job was taken already with the last wake-up
      const scene::DepthImage& image = sensor_.capture(job->X_WB);
      send(job->stamp, image);
      snapshots_.offer(image, job->X_WB, job->gate, job->passes, seconds(job->race_time));
      if (on_progress_ && job->stamp >= next_progress) {
        on_progress_(job->progress);
        next_progress = job->stamp + std::chrono::milliseconds(100);
      }
    }
  }

  void post_frame(Stamp now, Stamp race_time) {
    FrameJob& job = jobs_.slot();
    job = {now,
           race_time,
           pose_of(plant_->state()),
           referee_.expected_gate(),
           referee_.passes().size(),
           progress(race_time)};
    jobs_.publish();
    ++frames_posted_;
    posted_.fetch_add(1);
    posted_.notify_one();
  }

  static Stamp sleep_until(Stamp deadline) {
    const auto whole = std::chrono::duration_cast<std::chrono::seconds>(deadline);
    timespec until{};
    until.tv_sec = static_cast<time_t>(whole.count());
    until.tv_nsec = static_cast<long>((deadline - whole).count());
    while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr) == EINTR) {
    }
    return MonotonicClock().now();
  }

  /// Counts control periods without a new plan: between two plans that came `gap` apart lie round(gap / period)
  /// periods, each of which should have brought one. Plans that came and went unseen while this loop itself was late
  /// did come: their numbers tell.
  void take_commands(Stamp arrival) {
    while (const auto command = client_.newest()) {
      health_ = command->health;
      // A server that restarts counts from 1 again; then nothing is known but that one plan came.
      const std::uint64_t plans = command->sequence > last_sequence_ ? command->sequence - last_sequence_ : 1;
      if (last_command_ > Stamp{0}) count_gap(arrival - last_command_, plans);
      last_command_ = arrival;
      last_sequence_ = command->sequence;
    }
  }

  void count_gap(Stamp gap, std::uint64_t plans) {
    const auto periods = static_cast<std::uint64_t>(std::lround(seconds(gap) / seconds(control_period_)));
    if (periods > plans) report_.late_ticks += periods - plans;
  }

  void run_real_time() {
    std::thread camera([this] { run_camera(); });
    const Stamp state_period =
        std::max<Stamp>(Plant::kStep, Plant::kStep * std::lround(1000.0 / options_.state_rate_hz));
    const Stamp begin = MonotonicClock().now();
    Stamp slipped{0};  // real time given up on so far
    Stamp next_state{0}, next_frame{0};
    std::optional<Stamp> go;  // when the race began, on the same scale as `elapsed`
    Stamp first_command{0};

    for (Stamp elapsed{0}; !referee_.decided(); elapsed += Plant::kStep) {
      const Stamp now = begin + slipped + elapsed;  // the stamp of this step: when it should happen
      const Stamp woke = sleep_until(now);
      const Stamp late = woke - now;
      ++report_.loop_steps;
      if (late > kLoopTolerance) ++report_.loop_misses;
      report_.loop_worst_s = std::max(report_.loop_worst_s, seconds(late));
      if (late > kLoopSlip) slipped += late;

      const Stamp race_time = go ? elapsed - *go : Stamp{0};
      const QuadrotorState estimate = estimator_.estimate(plant_->state());
      if (elapsed >= next_frame) {
        post_frame(now, race_time);
        next_frame += frame_period();
      }
      if (elapsed >= next_state) {
        client_.send_state(now, estimate);
        next_state += state_period;
      }
      take_commands(MonotonicClock().now());
      if (!go && last_command_ > Stamp{0}) {
        go = elapsed;
        first_command = last_command_;
        report_.late_ticks = 0;
      }
      if (go) {
        advance(now, elapsed - *go, estimate);
      }
      const Stamp silent_since = last_command_ > Stamp{0} ? last_command_ : begin;
      if (woke - silent_since > options_.give_up) referee_.stop(Outcome::kLinkLost, race_time);
      if (stop_) referee_.stop(Outcome::kInterrupted, race_time);
    }
    if (go) {
      const Stamp end = MonotonicClock().now();
      count_gap(end - last_command_, 1);
      report_.control_ticks = static_cast<std::uint64_t>((end - first_command) / control_period_) + 1;
    }
    posted_.store(kCameraEnd);
    posted_.notify_one();
    camera.join();
  }

  void finish() {
    record(referee_.end_time(), last_setpoint_);
    report_.timing = options_.timing;
    report_.outcome = referee_.outcome();
    report_.sentence = referee_.sentence();
    report_.passes = referee_.passes();
    report_.gates_total = referee_.gates_total();
    report_.lap_times_s = referee_.lap_times_s();
    report_.race_time_s = seconds(referee_.end_time());
    report_.mean_speed_m_s = report_.race_time_s > 0 ? distance_m_ / report_.race_time_s : 0.0;
    report_.clearance_m = referee_.clearance_m();
    report_.culprit_gate = referee_.culprit();
    report_.end_state = plant_->state();
    report_.contacts = report_.outcome == Outcome::kTouchedGate || report_.outcome == Outcome::kTouchedFloor ||
                       report_.outcome == Outcome::kTouchedClutter;
    report_.link = client_.statistics();
    report_.control_period_s = seconds(control_period_);
    report_.frames_sent = frames_sent_;
    report_.frames_skipped = frames_posted_ > frames_sent_ ? frames_posted_ - frames_sent_ : 0;
    report_.snapshot = snapshots_.take();
  }

  static constexpr std::uint32_t kCameraEnd = UINT32_MAX;

  const config::Scenario& scenario_;
  const Options options_;
  sdk::Client& client_;
  const std::atomic<bool>& stop_;
  const ProgressFunction& on_progress_;
  const scene::World world_;
  std::unique_ptr<Plant> plant_;
  DepthSensor sensor_;  // real time: the camera thread's
  Estimator estimator_;
  SnapshotKeeper snapshots_;  // real time: the camera thread's until it is joined
  Referee referee_;
  Stamp control_period_{0};
  Report report_;
  protocol::PlannerHealth health_;
  sdk::Setpoint last_setpoint_;
  double distance_m_ = 0.0;
  Random link_;
  std::deque<State> states_;  // on their way, by stamp
  std::deque<Frame> frames_;
  Stamp last_command_{0};
  std::uint64_t last_sequence_ = 0;
  Mailbox<FrameJob> jobs_;
  std::atomic<std::uint32_t> posted_{0};
  std::uint64_t frames_posted_ = 0;  // real time: taken by the plant's thread
  std::uint64_t frames_sent_ = 0;    // real time: the camera thread's until it is joined
};

}  // namespace

Status validate(const Options& options) {
  if (options.link_delay < Stamp{0} || options.link_delay > std::chrono::seconds(1))
    return Error{"the link delay is " + std::to_string(1e3 * seconds(options.link_delay)) +
                 " ms, expected 0 to 1000 ms"};
  if (options.link_jitter < Stamp{0} || options.link_jitter > std::chrono::seconds(1))
    return Error{"the link's jitter is " + std::to_string(1e3 * seconds(options.link_jitter)) +
                 " ms, expected 0 to 1000 ms"};
  if (!(options.link_loss >= 0 && options.link_loss <= 0.9))
    return Error{"the link's loss is " + std::to_string(options.link_loss) + ", expected 0 to 0.9 of the messages"};
  if (options.timing == Timing::kRealTime &&
      (options.link_delay > Stamp{0} || options.link_jitter > Stamp{0} || options.link_loss > 0))
    return Error{"a link's delay, jitter and loss are only simulated in lockstep, expected none in real time"};
  if (!(options.state_rate_hz >= 10 && options.state_rate_hz <= 1000))
    return Error{"the state rate is " + std::to_string(options.state_rate_hz) + " Hz, expected 10 to 1000 Hz"};
  return {};
}

QuadrotorState start_state(const config::Scenario& scenario) {
  QuadrotorState state;
  state.p_WB = scenario.track.start_p_WB;
  state.q_WB = Eigen::Quaterniond(Eigen::AngleAxisd(scenario.track.start_yaw_rad, Eigen::Vector3d::UnitZ()));
  state.thrust_n = state.thrust_command_n =
      hover_thrust_n(config::true_quadrotor(scenario.vehicle.quadrotor, scenario.mismatch));
  return state;
}

Result<Report> fly(const config::Scenario& scenario, const Options& options, sdk::Client* client,
                   const std::atomic<bool>& stop, const ProgressFunction& on_progress) {
  if (auto status = validate(options); !status) return Error{status.error()};
  scene::World world = config::perturbed_world(scenario.track, scenario.perturbation, scenario.seed);
  auto plant = Plant::create(world, config::true_quadrotor(scenario.vehicle.quadrotor, scenario.mismatch),
                             scenario.mismatch.wind_W_m_s);
  if (!plant) return Error{plant.error()};
  return Race(scenario, options, client, stop, on_progress, std::move(world), std::move(plant).value()).run();
}

}  // namespace gatefield::simulator
