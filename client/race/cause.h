#pragma once

#include <limits>
#include <vector>

#include "client/simulator/run_log.h"
#include "common/scene/world.h"
#include "common/trace/trace.h"

namespace gatefield::race {

/// What a lost race was lost by.
enum class Cause {
  kNone,             ///< won
  kPerceptionWrong,  ///< the gate was seen and believed in another place, or another gate was headed for
  kSeenTooLate,      ///< never seen, or first when there was no time left to turn
  kReferee,          ///< nothing was hit or missed: out of time, or out of the flight volume
  kControl,          ///< the gate was known, and hit or missed all the same
  kNotRecorded,      ///< there is no trace of what the planner believed
};
inline constexpr Cause kCauses[] = {Cause::kPerceptionWrong, Cause::kSeenTooLate, Cause::kControl, Cause::kReferee,
                                    Cause::kNotRecorded};

/// "won", "perception_wrong", ...: for tables of programs.
const char* name(Cause cause) noexcept;
/// "perception wrong", ...: for people.
const char* words(Cause cause) noexcept;

/// Beyond this a belief is wrong: the opening's half-width less the vehicle's radius, and a little. Of gates whose
/// opening is 1.0 m; of others as much more or less as they are larger.
inline constexpr double kWrongCenter_m = 0.3;
inline constexpr double kWrongAxis_rad = 0.52;  ///< 30 degrees
/// The belief is judged over this time before the end (the planner's horizon), and a gate first seen less than this
/// before the end was seen too late.
inline constexpr double kJudged_s = 0.6;

struct Diagnosis {
  Cause cause = Cause::kNone;
  int waypoint = -1;  ///< whose gate the race was lost at, index into the course
  /// Median over the judged time of how far the believed centre was from the true one, and the believed axis from the
  /// true one, as the state estimate has it (simulator::Sample::X_EW); NaN: it was never seen, or nothing was recorded.
  double center_error_m = std::numeric_limits<double>::quiet_NaN();
  double axis_error_rad = std::numeric_limits<double>::quiet_NaN();
  double seen_before_s = std::numeric_limits<double>::quiet_NaN();  ///< how long before the end it was seen first
};

/// Holds what the planner believed against the truth.
/// @param report  of a race that is over
/// @param trace   of its planner, may be empty; stamps begin at simulator::kLockstepEpoch
/// @param gates   the true ones as they are passed, by waypoint (config::gates_by_waypoint)
Diagnosis diagnose(const simulator::Report& report, const std::vector<trace::Step>& trace,
                   const std::vector<scene::Gate>& gates);

}  // namespace gatefield::race
