#include "client/python/extension/refusal.h"

#include <utility>

#include "common/base/error_name.h"

namespace gatefield::python {

namespace py = pybind11;

py::str text(const std::string& bytes) {
  PyObject* const made = PyUnicode_DecodeUTF8(bytes.data(), static_cast<Py_ssize_t>(bytes.size()), "replace");
  if (made == nullptr) throw py::error_already_set();
  return py::reinterpret_steal<py::str>(made);
}

void refuse(const Error& error) {
  const py::object made =
      py::module_::import("gatefield.errors")
          .attr("refusal")(text(std::string(name(error.code))), text(error.message), text(error.field),
                           text(error.value), text(error.expected), text(error.file), error.line);
  PyErr_SetObject(reinterpret_cast<PyObject*>(Py_TYPE(made.ptr())), made.ptr());
  throw py::error_already_set();
}

}  // namespace gatefield::python
