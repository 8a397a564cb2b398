#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

namespace gatefield::protocol {

/// What can be wrong with a flight, as the server sees it. Numbers are bits of PlannerHealth::problems and travel on
/// the wire: new ones go to the end, none is used again. Those with a likely cause stand beside what was found: a
/// server that finds kVelocityAgainstMotion says kStatesLookNed as well when that would explain it.
enum class Problem : std::uint8_t {
  kGateNotSeen = 0,              ///< no gate was seen yet where one should be in view
  kFewEffectiveSamples = 1,      ///< the plan has followed one or two rollouts for a second
  kPlanNotFinite = 2,            ///< plans are withheld: not finite
  kPlanThrustRate = 3,           ///< plans are withheld: a thrust rate beyond the vehicle's limit
  kPlanThrust = 4,               ///< plans are withheld: a rotor thrust beyond the vehicle's limits
  kPlanBodyRate = 5,             ///< plans are withheld: a body rate beyond 200 rad/s
  kVelocityAgainstMotion = 6,    ///< the velocity is not the position's change
  kThrustAgainstMotion = 7,      ///< the thrust axis is not where the velocity's change points
  kRatesAgainstAttitude = 8,     ///< the body rates are not the attitude's change
  kStatesLookNed = 9,            ///< likely cause: states in NED and FRD instead of ENU and FLU
  kQuaternionLooksWFirst = 10,   ///< likely cause: a quaternion in the order w, x, y, z
  kVelocityLooksBodyFrame = 11,  ///< likely cause: a velocity in the body frame
  kRatesLookWorldFrame = 12,     ///< likely cause: body rates in the world frame
  kRotorsLookSwapped = 13,       ///< likely cause: rotors in another order, or spins unlike the true ones
  kMountingLooksWrong = 14,      ///< the camera's mounting contradicts what the images show
  kDepthUnitLooksWrong = 15,     ///< distances are too large or small by a factor: another unit
  kStampsJump = 16,              ///< stamps or sequence numbers jumped beyond bounds
  kDepthMissing = 17,            ///< no usable depth frame for half a second
  kStatesMissing = 18,           ///< no usable state for two control periods
  kStatesRejected = 19,          ///< newest states are refused (telemetry says why)
  kFramesRejected = 20,          ///< newest depth frames are refused (telemetry says why)
  kDelayLong = 21,               ///< the measured delay is longer than the planner makes up for
  kDeadlinesMissed = 22,         ///< control steps are late: too many vehicles, or too slow a machine
  kThrustUnlikeTold = 23,        ///< by body rates: the vehicle gives more or less thrust than it is asked for
  kRateLoopUnlikeTold = 24,      ///< by body rates: the rates follow faster or slower than was told
  kRateLimitUnlikeTold = 25,     ///< by body rates: the rates stay at a limit below what may be asked for
};
inline constexpr int kProblems = 26;

using Problems = std::uint64_t;  ///< a set of Problem: bit by number
constexpr Problems bit(Problem problem) noexcept { return Problems{1} << static_cast<unsigned>(problem); }

/// Machine-readable name, e.g. "velocity_against_motion".
std::string_view name(Problem problem) noexcept;
/// What was found, and what to look at, for people.
std::string_view sentence(Problem problem) noexcept;
/// Those in the set, by number. Bits that this version doesn't know are left out.
std::vector<Problem> list(Problems problems);

}  // namespace gatefield::protocol
