#pragma once

#include <pybind11/pybind11.h>

#include <string>

#include "common/base/result.h"

/// Failures of the SDK as Python's exceptions. All of it is called with the GIL held.
namespace gatefield::python {

/// As it is; bytes that are no UTF-8 (a peer's, a file's) as U+FFFD.
pybind11::str text(const std::string& bytes);

/// Raises what gatefield.errors makes of it: an exception of its kind that carries code, field, value, expected and
/// sentence.
[[noreturn]] void refuse(const Error& error);

template <typename T>
T value_or_refuse(Result<T> result) {
  if (!result) refuse(result.failure());
  return std::move(result).value();
}

}  // namespace gatefield::python
