#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "common/base/clock.h"
#include "common/base/result.h"
#include "common/protocol/messages.h"
#include "server/perception/gate_sensor.h"
#include "server/perception/sight.h"
#include "server/pilot/events.h"
#include "server/pilot/intake.h"
#include "server/pilot/looking.h"
#include "server/pilot/mailboxes.h"
#include "server/pilot/step_observer.h"
#include "server/pilot/stepping.h"
#include "server/planner/planner.h"

namespace gatefield::pilot {

/// What a pilot is made of.
struct PilotParts {
  protocol::SessionRequest request;  ///< accepted and valid
  std::uint64_t session = 0;         ///< goes into every sample; never 0
  std::uint32_t take_overs = 0;      ///< how often the session went to an heir until it was flown by this pilot
  std::unique_ptr<planner::Planner> planner;
  std::unique_ptr<perception::GateSensor> sensor;
  std::unique_ptr<StepObserver> observer;  ///< may be null
  perception::SightOptions sight;
  std::string isa;  ///< instruction set of the kernels, told in every command
  std::uint64_t model_hash = 0;
  Stamp now{0};  ///< server's clock, when the session begins
};

/// One vehicle's mind: states, depth frames and ticks in; commands and notes out. It knows no clock, thread, transport
/// or log: time is in the events, and the service that runs many pilots brings the threads.
///
/// It has three sides, each a class that belongs to one thread at a time:
///   intake()    receiving threads: what comes from the vehicle
///   looking()   a perception thread: what the frames show
///   stepping()  a control thread: the next command
/// The sides share Mailboxes and nothing else; none of them waits for another. save() belongs to whoever has stopped
/// the last two, restore() to whoever has stopped all three.
class Pilot {
 public:
  explicit Pilot(PilotParts parts);
  Pilot(const Pilot&) = delete;
  Pilot& operator=(const Pilot&) = delete;

  const protocol::SessionRequest& request() const noexcept { return request_; }
  const std::string& vehicle() const noexcept { return request_.vehicle; }
  std::uint64_t session() const noexcept { return session_; }
  std::uint32_t take_overs() const noexcept { return take_overs_; }
  bool lockstep() const noexcept { return request_.timing == protocol::Timing::kLockstep; }
  std::chrono::nanoseconds control_period() const noexcept { return stepping_.control_period(); }

  Intake& intake() noexcept { return intake_; }
  const Intake& intake() const noexcept { return intake_; }
  Looking& looking() noexcept { return looking_; }
  Stepping& stepping() noexcept { return stepping_; }

  /// One event from a record of them. @return the step's answer; empty for all but Ticked
  Stepping::Answer feed(const Event& event);

  // ---- for people (one thread: housekeeping) ----------------------------------------------------------------------
  void fill(Stamp now, protocol::Telemetry* telemetry);
  const Account& account() const noexcept { return shared_.account; }
  /// How the newest step found things.
  const protocol::PlannerHealth& health();
  /// What is wrong now.
  protocol::Problems problems() { return health().problems; }
  /// What went wrong since the last call, for the log: empty when nothing did.
  std::optional<std::string> complaints() { return shared_.account.complaints(); }
  /// The newest note; nothing when there was none.
  std::optional<Note> last_note() { return shared_.account.last_note(); }

  // ---- moving to another process ----------------------------------------------------------------------------------
  /// All that decides later commands, in some kilobytes. Counters for telemetry are left out, and so is a frame that
  /// nobody has looked at yet: the restored pilot takes it when it comes again.
  std::string save();
  /// Makes a pilot of the same session, which was not fed yet, go on where another one was: it gives the same commands,
  /// bit for bit, given the same model and instruction set. Again, from a later state, as often as it takes.
  /// @param clock_ahead  this server's clock less that of the server that saved, at the same moment
  /// Errors, which leave the pilot as it was: kVersion for another format or model, kInvalid for a state of another
  /// session, course or profile, or a damaged one.
  Status restore(std::string_view bytes, std::chrono::nanoseconds clock_ahead = std::chrono::nanoseconds{0});

 private:
  const protocol::SessionRequest request_;
  const std::uint64_t session_;
  const std::uint32_t take_overs_;
  const std::string isa_;
  const std::uint64_t model_hash_;
  Mailboxes shared_;
  Intake intake_;
  Looking looking_;
  Stepping stepping_;
  protocol::PlannerHealth last_health_;   // housekeeping
  protocol::IdentifiedDrive identified_;  // housekeeping
};

}  // namespace gatefield::pilot
