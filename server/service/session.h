#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "common/base/clock.h"
#include "common/base/mailbox.h"
#include "common/protocol/messages.h"
#include "server/perception/depth_encoder.h"
#include "server/perception/gate_memory.h"
#include "server/planner/course_progress.h"
#include "server/planner/planner.h"
#include "server/service/account.h"
#include "server/service/disturbance.h"
#include "server/service/known_gates.h"
#include "server/service/plan_guard.h"
#include "server/service/predictor.h"
#include "server/service/sight.h"
#include "server/service/state_history.h"

namespace gatefield::service {

/// What a session is made of.
struct SessionParts {
  protocol::SessionRequest request;  ///< accepted and valid
  std::uint64_t id = 0;              ///< goes into every sample; never 0
  std::unique_ptr<planner::Planner> planner;
  std::unique_ptr<Memory> memory;
  SightOptions sight;
  std::string isa;     ///< instruction set of the kernels, told in every command
  const Clock* clock;  ///< the server's clock
};

/// One vehicle: what came from it, what is known, and the next plan. Data goes one way, from mailbox to mailbox:
///
/// - receiving threads: take_state(), take_depth() (session_intake.cpp)
/// - a perception thread: perceive() (session_perception.cpp)
/// - a control thread: step() gives the command to send (session_step.cpp)
///
/// Each of these sides may be called from any thread, but never from two at once on the same side (the receiving side
/// is guarded by short mutexes of its own); none of them waits for another.
///
/// Real time: step() is called at every control tick. It predicts the newest state forward to the moment when the plan
/// can begin to hold at the vehicle, and goes on from its own prediction when no state comes; after kSilence without
/// one it sends nothing more, and the client falls back.
///
/// Lockstep: step() is called when something came. It answers each new state once, after the depth frame which that
/// state names was processed (or kDepthWait passed); a state that comes again is answered with the same command again.
/// The state is predicted by the delay that the client measured in simulated time, and by nothing else: no clock is
/// involved. The same states and frames give the same commands (but for the measured times in `health`).
class Session {
 public:
  static constexpr std::chrono::nanoseconds kSilence = std::chrono::milliseconds(500);
  /// Long enough for a client that repeats a lost frame; a race on a busy machine stays the same as long as it is not
  /// used up.
  static constexpr std::chrono::nanoseconds kDepthWait = std::chrono::seconds(1);
  static constexpr std::chrono::nanoseconds kLongestValidity = std::chrono::milliseconds(400);
  /// Without a usable depth frame for this long a plan is called degraded.
  static constexpr std::chrono::nanoseconds kDepthMissing = std::chrono::milliseconds(500);
  /// "Never" for times to wake up at.
  static constexpr Stamp kNever = Stamp::max();

  explicit Session(SessionParts parts);
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  const protocol::SessionRequest& request() const noexcept { return request_; }
  const std::string& vehicle() const noexcept { return request_.vehicle; }
  std::uint64_t id() const noexcept { return id_; }
  bool lockstep() const noexcept { return request_.timing == protocol::Timing::kLockstep; }
  std::chrono::nanoseconds control_period() const noexcept { return period_; }
  /// When (server's clock) the newest good state came; when the session began, if none has. Any thread.
  Stamp last_heard() const noexcept { return Stamp{last_heard_.load(std::memory_order_relaxed)}; }

  // ---- receiving side ---------------------------------------------------------------------------------------------
  enum class Intake {
    kTaken,
    kRepeated,  ///< the newest one came again (a lockstep client asks for its answer; nothing else happens)
    kRejected,  ///< counted, with a reason for telemetry and log
  };
  Intake take_state(const protocol::VehicleState& state);
  /// Takes the pixels by swapping buffers when the frame is good. A frame that comes again is left alone.
  Intake take_depth(protocol::DepthFrame& frame);
  /// A sample of this vehicle was refused before it got here.
  void note_rejected_state(const std::string& reason);
  void note_rejected_frame(const std::string& reason);

  // ---- perception side --------------------------------------------------------------------------------------------
  /// There is a frame to process now. Lockstep: not before a state named it, because that state's pose is what the
  /// frame is bound to. Any thread.
  bool frame_due() const noexcept;
  /// Processes the newest frame. @return false when there was none. Never throws.
  bool perceive(perception::DepthEncoder& encoder) noexcept;

  // ---- control side -----------------------------------------------------------------------------------------------
  struct Answer {
    const protocol::ThrustRateCommand* command = nullptr;  ///< to be sent now; valid until the next step()
    Stamp wake_at = kNever;  ///< lockstep: call again then, if nothing comes before (a depth frame is awaited)
  };
  /// The control step. No allocation, lock, log or system call (the clock is read through vDSO).
  Answer step(Stamp now) noexcept;
  /// After the command was handed to the transport. @param ok  what the transport said
  void sent(Stamp now, bool ok) noexcept;
  void missed_deadlines(std::uint64_t count) noexcept {
    account_.deadlines_missed.fetch_add(count, std::memory_order_relaxed);
  }

  // ---- for people (one thread: housekeeping) ----------------------------------------------------------------------
  void fill(Stamp now, protocol::Telemetry* telemetry);
  /// What was rejected since the last call, for the log: empty when nothing was.
  std::optional<std::string> rejections() { return account_.complaints(); }

 private:
  struct StateSample {
    std::uint64_t sequence = 0;
    Stamp stamp{0};
    Stamp received{0};  ///< server's clock
    QuadrotorState state;
    bool thrust_known = true;
    Stamp round_trip{0};
    std::uint64_t depth_sequence = 0;
    std::uint32_t heard_waypoint = 0;
    std::uint32_t heard_lap = 0;
  };
  struct DepthSample {
    std::uint64_t sequence = 0;
    Stamp stamp{0};
    protocol::DepthEncoding encoding = protocol::DepthEncoding::kMillimetres16;
    std::vector<std::uint8_t> pixels;
  };

  Status check(const protocol::VehicleState& state) const;
  Status check(const protocol::DepthFrame& frame) const;
  void publish_target(const planner::CourseProgress& progress) noexcept;
  /// What the planner heads for: the belief, with the nominal waypoint in its place where the profile wants that.
  planner::GateBelief planned_gate(std::uint32_t waypoint) const noexcept;
  void take_in(const StateSample& sample) noexcept;
  void watch_disturbance(const StateSample& sample) noexcept;
  void leave(const planner::GateBelief& gate) noexcept;
  void fill_command(Stamp plan_start, const planner::Plan& plan) noexcept;

  const protocol::SessionRequest request_;
  const std::uint64_t id_;
  const Clock* const clock_;
  const std::chrono::nanoseconds period_;
  const std::string isa_;

  // Receiving side. The mutexes are held for the length of a copy or less, and by receiving threads only.
  std::mutex states_mutex_;
  std::uint64_t last_state_sequence_ = 0;
  Stamp last_state_stamp_{0};
  std::mutex frames_mutex_;
  std::uint64_t last_frame_sequence_ = 0;
  Stamp last_frame_stamp_{0};
  std::atomic<std::int64_t> last_heard_;

  // Between the sides.
  Mailbox<StateSample> states_;
  Mailbox<DepthSample> frames_;
  Mailbox<perception::MemorySnapshot> memories_;
  Mailbox<protocol::PlannerHealth> healths_;
  StateHistory history_;  // receiving side writes, perception reads
  std::atomic<bool> newest_state_rejected_{false};
  std::atomic<bool> repeat_wanted_{false};
  std::atomic<std::uint64_t> frame_named_{0};       // newest depth_sequence that a state named
  std::atomic<std::uint64_t> frame_arrived_{0};     // newest in the mailbox
  std::atomic<std::uint64_t> frame_refused_{0};     // newest that was refused on arrival: nobody needs to wait for it
  std::atomic<std::uint64_t> frame_processed_{0};   // newest whose result is in memories_
  std::atomic<std::int64_t> good_frame_stamp_{-1};  // capture of the newest frame with something in it
  std::atomic<std::uint64_t> target_{0};            // packed target and next, written by control, read by perception

  Account account_;                      // all sides
  protocol::PlannerHealth last_health_;  // housekeeping

  // Perception side.
  Sight sight_;

  // Control side.
  std::unique_ptr<planner::Planner> planner_;
  planner::CourseProgress progress_;  // from states that were measured
  planner::CourseProgress ahead_;     // the same, moved on to where the plan starts
  KnownGates gates_;
  StateSample newest_;
  bool have_state_ = false;
  bool state_is_new_ = false;
  bool have_rotors_ = false;
  QuadrotorState rotors_;  // thrusts only, modelled when the vehicle can't tell
  Stamp rotors_stamp_{0};
  Stamp first_stamp_{0};
  InputTimeline inputs_;
  DelayEstimate delay_;
  Disturbance disturbance_;
  QuadrotorState measured_;  // the last state taken in, with its rotors
  Stamp measured_stamp_{-1};
  bool delay_known_ = false;
  planner::GateBelief left_;  // the gate passed last, without its field
  bool have_left_ = false;
  planner::Plan plan_;
  std::uint64_t steps_made_ = 0;
  bool have_plan_ = false;
  Stamp last_plan_start_{0};
  bool holding_ = false;
  planner::GateBelief hold_;
  protocol::ThrustRateCommand command_;
  bool command_good_ = false;
  bool first_answer_ = false;
};

}  // namespace gatefield::service
