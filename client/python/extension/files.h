#pragma once

#include <pybind11/pybind11.h>

/// Vehicle and course files of the repository's formats, as the arguments of Python's classes.
namespace gatefield::python {

void bind_files(pybind11::module_* module);

}  // namespace gatefield::python
