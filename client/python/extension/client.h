#pragma once

#include <pybind11/pybind11.h>

/// The class Client of the extension, and connect().
namespace gatefield::python {

void bind_client(pybind11::module_* module);

}  // namespace gatefield::python
