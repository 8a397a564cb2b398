#pragma once

#include <cstdint>

#include "common/vehicle/actuation.h"

namespace gatefield::protocol {

/// Who says what a vehicle of body rates is asked for.
enum class AskedBy : std::uint8_t {
  kPlans = 0,     ///< the plans as the server sent them
  kFallback = 1,  ///< the client's fallback, until a plan holds
  kOther = 2,     ///< something else, until told otherwise: a supervisor's manoeuvre, a mixture of that and a plan
  kUnknown = 3,   ///< nobody knows: motors off, on the ground, in other hands
};

/// What a vehicle of body rates is really asked for, as a state says it: when the state held, and until a later one
/// says otherwise. A vehicle of rotor thrusts says kPlans: QuadrotorState::thrust_command_n is what it is asked for.
struct Asked {
  AskedBy by = AskedBy::kPlans;
  RateCommand command = RateCommand::Zero();  ///< of kFallback and kOther; else 0
  bool told() const noexcept { return by == AskedBy::kFallback || by == AskedBy::kOther; }
};

}  // namespace gatefield::protocol
