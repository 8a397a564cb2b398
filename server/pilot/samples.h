#pragma once

#include <cstdint>
#include <vector>

#include "common/base/clock.h"
#include "common/protocol/messages.h"
#include "common/vehicle/quadrotor.h"

namespace gatefield::pilot {

/// A vehicle's state that was checked.
struct StateSample {
  std::uint64_t sequence = 0;
  Stamp stamp{0};
  std::uint32_t line = 0;   ///< number of its time line, from 0
  Stamp received{0};        ///< server's clock
  std::uint32_t jumps = 0;  ///< how often the motion was taken up elsewhere (MotionLine)
  QuadrotorState state;     ///< attitude of unit length
  bool thrust_known = true;
  Stamp round_trip{0};
  std::uint64_t depth_sequence = 0;
  std::uint32_t heard_waypoint = 0;
  std::uint32_t heard_lap = 0;
  protocol::Asked asked;
};

/// A depth frame that was checked against the camera.
struct DepthSample {
  std::uint64_t sequence = 0;
  Stamp stamp{0};
  std::uint32_t line = 0;  ///< number of the frames' time line, from 0; the states' is another
  protocol::DepthEncoding encoding = protocol::DepthEncoding::kCounts16;
  std::vector<std::uint8_t> pixels;
};

}  // namespace gatefield::pilot
