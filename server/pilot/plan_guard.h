#pragma once

#include "common/protocol/problems.h"
#include "common/vehicle/actuation.h"
#include "common/vehicle/quadrotor.h"
#include "server/planner/planner.h"

namespace gatefield::pilot {

/// Why a plan is not sent.
enum class Withheld : int { kNothing = 0, kNotFinite, kRateLimit, kThrustLimit, kBodyRate };

/// The last look at a plan before it goes out, whatever the planner says of it: all of its first
/// protocol::kMaxPlanSteps steps finite, thrust rates and thrusts within the vehicle's limits (but for rounding), body
/// rates, of vehicles that are asked for them what is asked, below 200 rad/s. Thread-safe: yes.   Real-time safe: yes.
Withheld why_withheld(const QuadrotorModel& model, Actuation::Kind kind, const planner::Plan& plan) noexcept;

/// The reason as health tells it; none for kNothing.
protocol::Problems problems(Withheld why) noexcept;
/// The reason in words; empty for kNothing.
const char* sentence(Withheld why) noexcept;

}  // namespace gatefield::pilot
