#pragma once

#include <pybind11/pybind11.h>

/// Makes the classes of what the SDK gives out: Plan, Setpoint, Session, Telemetry and the like (_gatefield.pyi says
/// what each has).
namespace gatefield::python {

void bind_results(pybind11::module_* module);

}  // namespace gatefield::python
