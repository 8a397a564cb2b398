#pragma once

#include "server/service/costs.h"
#include "server/service/service.h"

namespace gatefield::service {

/// What vehicles of these profiles will cost, by a trial before any has come: for each profile a pilot with the real
/// planner and sensor hovers before a drawn gate for a few steps, on this thread alone. Tens of milliseconds.
/// Processor time is measured, so what else runs on the machine matters little. A factory that refuses the trial's
/// vehicle (a baseline that knows one course) leaves its part unknown.
/// Thread-safe: yes, while nobody flies.   Real-time safe: no.
Costs costs_by_trial(const Profiles& profiles, const Factories& factories);

}  // namespace gatefield::service
