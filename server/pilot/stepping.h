#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>

#include "common/base/clock.h"
#include "common/protocol/messages.h"
#include "server/gates/course_progress.h"
#include "server/gates/known_gates.h"
#include "server/pilot/diagnosis.h"
#include "server/pilot/disturbance.h"
#include "server/pilot/drive_watch.h"
#include "server/pilot/mailboxes.h"
#include "server/pilot/predictor.h"
#include "server/pilot/state_watch.h"
#include "server/pilot/step_observer.h"
#include "server/pilot/thrust_factor.h"
#include "server/planner/planner.h"

namespace gatefield::pilot {

/// The control side of a pilot: from the newest state and what is known of the gates to the command to send.
///
/// Real time: step() is called at every control tick. It predicts the newest state forward to the moment when the plan
/// can begin to hold at the vehicle, and goes on from its own prediction when no state comes; after kSilence without
/// one it sends nothing more, and the client falls back.
///
/// Lockstep: step() is called when something came. It answers each new state once, after the depth frame which that
/// state names was looked at (or kDepthWait passed); a state that comes again is answered with the same command again.
/// The state is predicted by the delay that the client measured in simulated time, and by nothing else: no clock is
/// involved. The same states and frames give the same commands (but for the measured times in `health`).
///
/// A state of another time line than the one before (TimeLine) begins anew what is bound to stamps: what was sent, the
/// delay, how old things are. Progress along the course, the gates and the planner's warm start stay. A vehicle that
/// is found elsewhere (MotionLine) flew through no gate on its way there.
///
/// What looks wrong (StateWatch, Diagnosis) is told in every command's health and, when no command goes out, through
/// Mailboxes::healths alone. The watches decide no command, so they are not written down with the rest.
///
/// Each step() that gives a command is followed by solved(), and by sent() once the command was handed over.
/// Thread-safe: no (one control thread at a time).   Real-time safe: step(), solved(), sent(), spent() and
/// missed_deadlines(): no allocation, lock, log, clock or system call.
class Stepping {
 public:
  static constexpr std::chrono::nanoseconds kSilence = std::chrono::milliseconds(500);
  /// Long enough for a client that repeats a lost frame; a race on a busy machine stays the same as long as it is not
  /// used up.
  static constexpr std::chrono::nanoseconds kDepthWait = std::chrono::seconds(1);
  static constexpr std::chrono::nanoseconds kMaxValidity = std::chrono::milliseconds(400);
  /// Without a usable depth frame for this long a plan is called degraded.
  static constexpr std::chrono::nanoseconds kDepthMissing = std::chrono::milliseconds(500);
  /// A gate that was never seen should be when its centre is this near, in front, and this far inside the image.
  static constexpr double kSeenWithin_m = 8.0;
  static constexpr double kSeenMargin_px_per_width = 0.1;
  /// "Never" for times to wake up at.
  static constexpr Stamp kNever = Stamp::max();

  /// @param request   of the session; @param shared  both outlive this
  /// @param observer  may be null
  /// @param isa       instruction set of the kernels, told in every command
  Stepping(const protocol::SessionRequest* request, std::uint64_t session, const std::string& isa,
           std::unique_ptr<planner::Planner> planner, std::unique_ptr<StepObserver> observer, Mailboxes* shared);

  std::chrono::nanoseconds control_period() const noexcept { return period_; }

  struct Answer {
    const protocol::ThrustRateCommand* command = nullptr;  ///< to be sent now; valid until the next step()
    Stamp wake_at = kNever;  ///< lockstep: call again then, if nothing comes before (a depth frame is awaited)
  };
  /// The control step. @param now  server's clock
  Answer step(Stamp now) noexcept;
  /// How long the step took that gave the command; real-time plans begin as much later.
  void solved(std::chrono::nanoseconds took) noexcept;
  /// The command was handed to the transport. @param ok  what the transport said
  void sent(Stamp now, bool ok) noexcept;
  /// Processor time of a step, by whoever measures it.
  void spent(std::chrono::nanoseconds cpu) noexcept {
    shared_->account.step_cpu_ns.fetch_add(cpu.count(), std::memory_order_relaxed);
  }
  /// Another server flew this session and sent this command after it wrote down what was restored here: the vehicle
  /// has it, and what goes on from here is predicted through it. @pre command passed protocol::validate
  void sent_elsewhere(const protocol::ThrustRateCommand& command) noexcept;
  void narrow_tick() noexcept { Account::count(shared_->account.ticks_narrow); }
  void missed_deadlines(std::uint64_t count) noexcept { Account::count(shared_->account.deadlines_missed, count); }

  planner::Planner& planner() noexcept { return *planner_; }
  gates::CourseProgress& progress() noexcept { return progress_; }
  const gates::KnownGates& gates() const noexcept { return gates_; }
  /// Takes in what lies in the mailboxes, as the next step would; for whoever writes the state down.
  void absorb() noexcept;

  /// All that decides later commands, beside planner, progress and gates: to be written down, and set to what was.
  struct State {
    StateSample newest;
    bool have_state = false;
    std::uint32_t line = 0;     ///< number of the time line that all stamps below are of
    std::uint32_t jumps = 0;    ///< of the newest sample that was taken in
    bool state_is_new = false;  ///< `newest` was not planned from yet
    bool have_rotors = false;
    /// Thrusts only, modelled when the vehicle can't tell. By body rates always modelled: a rate loop moves the rotors
    /// by itself, and a plan that began with that would feed it back.
    QuadrotorState rotors;
    Stamp rotors_stamp{0};
    Stamp first_stamp{0};  ///< of the line's first state
    InputTimeline inputs;
    DelayEstimate delay;
    bool delay_known = false;
    Disturbance disturbance;
    ThrustFactor thrust_factor;  ///< by body rates
    QuadrotorState measured;     ///< the last state taken in, with its rotors
    Stamp measured_stamp{-1};
    gates::GateBelief passed;  ///< the gate flown through last, without its field
    bool have_passed = false;
    std::uint64_t steps_made = 0;
    bool have_plan = false;
    Stamp last_plan_start{0};
    bool holding = false;
    gates::GateBelief hold;  ///< where to stay behind the last gate
    protocol::ThrustRateCommand command;
    bool command_good = false;
    bool first_answer = false;  ///< `command` is the first answer to its state
  };
  const State& state() const noexcept { return state_; }
  /// @pre from a pilot of the same session, course and profile
  void restore(const State& state) noexcept { state_ = state; }

 private:
  bool lockstep() const noexcept { return request_->timing == protocol::Timing::kLockstep; }
  /// What the planner aims at: the belief, with the nominal waypoint in its place where the profile wants that.
  gates::GateBelief planned(std::uint32_t waypoint) const noexcept;
  void read_state() noexcept;
  void read_beliefs() noexcept;
  void begin_line(const StateSample& sample) noexcept;
  void take_in(const StateSample& sample) noexcept;
  bool by_rates() const noexcept { return request_->actuation.kind == Actuation::Kind::kBodyRates; }
  InputTimeline nothing_sent() const noexcept;
  Dynamics dynamics() const noexcept;
  void compare_with_prediction(const StateSample& sample) noexcept;
  DriveWatch new_drive_watch() const noexcept;
  void watch_drive(const StateSample& sample, bool asked_known) noexcept;
  void hold_behind(const planner::PlanInput& input) noexcept;
  void fill_command(Stamp plan_start) noexcept;
  void fill_health(std::chrono::nanoseconds horizon, double field_age_s, bool degraded, Withheld withheld) noexcept;
  bool depth_missing() const noexcept;
  bool target_should_be_seen() const noexcept;
  protocol::Problems diagnose(double effective_samples, Withheld withheld) noexcept;

  const protocol::SessionRequest* request_;
  Mailboxes* shared_;
  std::unique_ptr<planner::Planner> planner_;
  std::unique_ptr<StepObserver> observer_;
  const std::chrono::nanoseconds period_;
  gates::CourseProgress progress_;  // from states that were measured
  gates::CourseProgress ahead_;     // the same, moved on to where the plan starts
  gates::KnownGates gates_;
  State state_;
  planner::Plan plan_;
  StateWatch state_watch_;
  DriveWatch drive_watch_;
  protocol::IdentifiedDrive identified_;
  protocol::Problems contradictions_ = 0;  // of state_watch_, as of the newest state
  Diagnosis diagnosis_;
  bool states_missing_ = false;  // real time: late in the step in progress
  bool unsolved_ = false;        // the newest command waits for solved()
};

}  // namespace gatefield::pilot
