#pragma once

#include "client/firmware/mavlink/frame.h"

namespace gatefield::firmware {

/// As whom the simulator speaks: of the vehicle's system, and a component that no autopilot has.
inline constexpr mavlink::Address kSimulatorAddress{1, 51};

}  // namespace gatefield::firmware
