#pragma once

#include <chrono>
#include <variant>

#include "common/base/clock.h"
#include "common/protocol/messages.h"

namespace gatefield::pilot {

/// What can happen to a pilot, one after another. Everything that later plans depend on is in here, what was measured
/// included: a pilot that is fed the same events again gives the same commands, bit for bit (on one instruction set).
/// Two things are told beside a plan, in its health, and are no events: deadlines that the pool missed
/// (Stepping::missed_deadlines()) and samples that were refused before they got here (Intake::note_rejected_*()).
struct StateArrived {
  Stamp at{0};  ///< server's clock
  protocol::VehicleState state;
};
struct FrameArrived {
  Stamp at{0};  ///< server's clock
  protocol::DepthFrame frame;
};
/// The perception side looked at the newest frame, if there was one.
struct Looked {
  std::chrono::nanoseconds took{0};
};
/// A control tick. Lockstep: something came.
struct Ticked {
  Stamp at{0};  ///< server's clock
};
/// How long the step took that gave the newest command.
struct Solved {
  std::chrono::nanoseconds took{0};
};
/// The newest command was handed to the transport.
struct Sent {
  Stamp at{0};     ///< server's clock
  bool ok = true;  ///< what the transport said
};

using Event = std::variant<StateArrived, FrameArrived, Looked, Ticked, Solved, Sent>;

}  // namespace gatefield::pilot
