#pragma once

#include <cstdint>
#include <mutex>

#include "common/base/clock.h"
#include "common/base/result.h"
#include "common/protocol/messages.h"
#include "server/pilot/mailboxes.h"
#include "server/pilot/motion_line.h"
#include "server/pilot/time_line.h"

namespace gatefield::pilot {

/// The receiving side of a pilot: states and depth frames are checked here, and put where the other sides find them.
/// States and frames each keep to a TimeLine: one sample whose sequence or stamp lies off the line is left out, and
/// when TimeLine::kAgree in a row go on from each other elsewhere, the line is taken up there under the next number. A
/// new line of states empties the history; the other sides see its number in the samples. States keep to a MotionLine,
/// too: one whose position, velocity or attitude the speeds don't explain is left out, and until as many in a row agree
/// elsewhere. A motion that is taken up elsewhere empties the history as well.
/// Thread-safe: yes; by mutexes of its own, held for the length of a copy or less and by receiving threads only.
/// Real-time safe: no.
class Intake {
 public:
  /// @param request  of the session; @param shared  both outlive this
  /// @param session  number that samples have to carry
  Intake(const protocol::SessionRequest* request, std::uint64_t session, Mailboxes* shared);

  enum class Outcome {
    kTaken,
    kRepeated,  ///< the newest one came again (a lockstep client asks for its answer; nothing else happens)
    kRejected,  ///< counted, with a note for telemetry and log
  };
  /// @param now  server's clock
  Outcome take_state(const protocol::VehicleState& state, Stamp now);
  /// Takes the pixels by swapping buffers when the frame is good. A frame that comes again is left alone.
  Outcome take_depth(protocol::DepthFrame& frame, Stamp now);
  /// A sample of this vehicle was refused before it got here.
  void note_rejected_state(const Error& why);
  void note_rejected_frame(const Error& why);

  /// When (server's clock) the newest good state came; when the session began, if none has.
  Stamp last_heard() const noexcept { return Stamp{shared_->last_heard.load(std::memory_order_relaxed)}; }

  /// The order of one kind of samples.
  struct Line {
    TimeLine order;
    std::uint32_t number = 0;  ///< of the time line: how many new ones began
  };
  /// All there is beside the mailboxes: to be written down, and set to what was.
  struct State {
    Line states;
    Line frames;
    MotionLine motion;  ///< of the states
  };
  State state() const;
  void restore(const State& state) noexcept { lines_ = state; }

 private:
  Status check(const protocol::VehicleState& state) const;
  Status check(const protocol::DepthFrame& frame) const;
  bool lockstep() const noexcept { return request_->timing == protocol::Timing::kLockstep; }

  const protocol::SessionRequest* request_;
  const std::uint64_t session_;
  Mailboxes* shared_;
  mutable std::mutex states_mutex_, frames_mutex_;
  State lines_;  // each line under its mutex, the motion under the states'
};

}  // namespace gatefield::pilot
