#include "client/python/extension/fields.h"

#include <algorithm>
#include <limits>

#include "client/python/extension/refusal.h"

namespace gatefield::python {

namespace py = pybind11;

namespace {

constexpr std::size_t kLongestShown = 60;

/// As Python shows it, in few words.
std::string shown(py::handle value) {
  if (py::isinstance<py::array>(value)) {
    const auto array = py::reinterpret_borrow<py::array>(value);
    return "an array of shape " + std::string(py::str(array.attr("shape"))) + " and dtype " +
           std::string(py::str(array.dtype()));
  }
  std::string text;
  try {
    text = std::string(py::repr(value));
  } catch (const py::error_already_set&) {
    text = "one that can't be shown";
  }
  if (text.size() > kLongestShown) text = text.substr(0, kLongestShown) + "...";
  return text + " (" + Py_TYPE(value.ptr())->tp_name + ")";
}

[[noreturn]] void refuse_value(const std::string& field, py::handle value, const std::string& expected) {
  PyErr_Clear();
  refuse(Error::invalid(field, shown(value), expected));
}

/// An index or a number that is one (NumPy's integers too), as Python's int; empty when it is none.
py::object as_integer(py::handle value) {
  PyObject* const made = PyNumber_Index(value.ptr());
  if (made == nullptr) PyErr_Clear();
  return py::reinterpret_steal<py::object>(made);
}

std::string of_shape(const std::vector<int>& shape) {
  std::string text = "(";
  for (std::size_t i = 0; i < shape.size(); ++i)
    text += (i ? ", " : "") + (shape[i] < 0 ? std::string("any") : std::to_string(shape[i]));
  return text + (shape.size() == 1 ? ",)" : ")");
}

}  // namespace

double to_number(py::handle value, const std::string& field) {
  const double number = PyUnicode_Check(value.ptr()) ? -1.0 : PyFloat_AsDouble(value.ptr());
  if (PyUnicode_Check(value.ptr()) || (number == -1.0 && PyErr_Occurred() != nullptr))
    refuse_value(field, value, "a number");
  return number;
}

std::uint64_t to_count(py::handle value, const std::string& field, std::uint64_t most) {
  const std::string expected = "an integer from 0 to " + std::to_string(most);
  const py::object integer = as_integer(value);
  if (!integer) refuse_value(field, value, expected);
  const std::uint64_t count = PyLong_AsUnsignedLongLong(integer.ptr());
  if (PyErr_Occurred() != nullptr || count > most) refuse_value(field, value, expected);
  return count;
}

Stamp to_stamp(py::handle value, const std::string& field) {
  const py::object integer = as_integer(value);
  const std::string expected = "nanoseconds as an integer (gatefield.nanoseconds(seconds) makes them of a float)";
  if (!integer) refuse_value(field, value, expected);
  const long long stamp = PyLong_AsLongLong(integer.ptr());
  if (stamp == -1 && PyErr_Occurred() != nullptr) refuse_value(field, value, expected + " of 64 bits");
  return Stamp{stamp};
}

std::string to_text(py::handle value, const std::string& field) {
  if (!PyUnicode_Check(value.ptr())) refuse_value(field, value, "text");
  Py_ssize_t size = 0;
  const char* const bytes = PyUnicode_AsUTF8AndSize(value.ptr(), &size);
  if (bytes == nullptr) refuse_value(field, value, "text that UTF-8 can hold");
  return {bytes, static_cast<std::size_t>(size)};
}

py::array_t<double> to_array(py::handle value, const std::string& field, const std::vector<int>& shape) {
  auto array = py::array_t<double, py::array::c_style | py::array::forcecast>::ensure(value);
  bool fits = array && array.ndim() == static_cast<py::ssize_t>(shape.size());
  for (std::size_t i = 0; fits && i < shape.size(); ++i)
    fits = shape[i] < 0 || array.shape(static_cast<py::ssize_t>(i)) == shape[i];
  if (!fits) refuse_value(field, value, "numbers of shape " + of_shape(shape));
  return array;
}

py::object Fields::get(const char* name) const {
  PyObject* const found = PyObject_GetAttrString(object_.ptr(), name);
  if (found == nullptr) {
    PyErr_Clear();
    refuse(Error::invalid(path_.empty() ? name : path_, shown(object_),
                          std::string("an object with the attribute '") + name + "'"));
  }
  return py::reinterpret_steal<py::object>(found);
}

bool Fields::flag(const char* name) const {
  const py::object value = get(name);
  const int truth = PyObject_IsTrue(value.ptr());
  if (truth < 0) refuse_value(path(name), value, "True or False");
  return truth != 0;
}

std::vector<py::object> Fields::objects(const char* name) const {
  const py::object value = get(name);
  std::vector<py::object> all;
  const auto items = py::reinterpret_steal<py::object>(
      PyUnicode_Check(value.ptr()) ? nullptr : PySequence_Fast(value.ptr(), "no sequence"));
  if (!items) refuse_value(path(name), value, "a list");
  for (Py_ssize_t i = 0; i < PySequence_Fast_GET_SIZE(items.ptr()); ++i)
    all.push_back(py::reinterpret_borrow<py::object>(PySequence_Fast_GET_ITEM(items.ptr(), i)));
  return all;
}

std::vector<std::string> Fields::texts(const char* name) const {
  std::vector<std::string> all;
  for (const py::object& one : objects(name)) all.push_back(to_text(one, path(name)));
  return all;
}

std::size_t Fields::choice(const char* name, const std::vector<std::string>& names) const {
  const py::object value = get(name);
  const auto found =
      PyUnicode_Check(value.ptr()) ? std::find(names.begin(), names.end(), to_text(value, path(name))) : names.end();
  if (found != names.end()) return static_cast<std::size_t>(found - names.begin());
  std::string expected;
  for (const std::string& one : names) expected += (expected.empty() ? "'" : " or '") + one + "'";
  refuse_value(path(name), value, expected);
}

}  // namespace gatefield::python
