#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "common/base/clock.h"

/// Reads the attributes of Python objects, and names them when they are not what was expected: "quadrotor.mass_kg is
/// 'heavy', expected a number" (gatefield.Invalid). All of it is called with the GIL held.
namespace gatefield::python {

double to_number(pybind11::handle value, const std::string& field);
/// @param most  the largest that is taken; the smallest is 0
std::uint64_t to_count(pybind11::handle value, const std::string& field, std::uint64_t most);
/// Nanoseconds as an integer (Python's or NumPy's). A float is refused: seconds are the likely mistake, and a double
/// doesn't hold the nanoseconds of a clock that has run for long.
Stamp to_stamp(pybind11::handle value, const std::string& field);
std::string to_text(pybind11::handle value, const std::string& field);
/// C-contiguous, of exactly this shape; a number of -1 in it: any.
pybind11::array_t<double> to_array(pybind11::handle value, const std::string& field, const std::vector<int>& shape);

/// One object's attributes.
class Fields {
 public:
  /// @param path  the object's own ("quadrotor"); empty: names of attributes stand by themselves
  Fields(pybind11::handle object, std::string path) : object_(object), path_(std::move(path)) {}

  pybind11::object get(const char* name) const;
  std::string path(const char* name) const { return path_.empty() ? name : path_ + "." + name; }

  double number(const char* name) const { return to_number(get(name), path(name)); }
  std::uint64_t count(const char* name, std::uint64_t most) const { return to_count(get(name), path(name), most); }
  bool flag(const char* name) const;
  std::string text(const char* name) const { return to_text(get(name), path(name)); }
  std::vector<std::string> texts(const char* name) const;
  /// A sequence of objects.
  std::vector<pybind11::object> objects(const char* name) const;

  template <int kSize>
  Eigen::Matrix<double, kSize, 1, Eigen::DontAlign> vector(const char* name) const {
    const auto array = to_array(get(name), path(name), {kSize});
    return Eigen::Map<const Eigen::Matrix<double, kSize, 1, Eigen::DontAlign>>(array.data());
  }

  /// One of `names`, as its place among them.
  std::size_t choice(const char* name, const std::vector<std::string>& names) const;

 private:
  const pybind11::handle object_;
  const std::string path_;
};

}  // namespace gatefield::python
