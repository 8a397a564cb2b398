#include "client/python/extension/depth.h"

#include <string>

#include "client/python/extension/refusal.h"

namespace gatefield::python {

namespace py = pybind11;

namespace {

constexpr int kAsItLies = py::array::c_style;
constexpr int kConverted = py::array::c_style | py::array::forcecast;

bool fits(const py::array& array, int height_px, int width_px) {
  const auto is = [&array](int axis, int size) { return array.shape(axis) == size; };
  switch (array.ndim()) {
    case 1:
      return array.shape(0) == py::ssize_t{height_px} * width_px;
    case 2:
      return is(0, height_px) && is(1, width_px);
    case 3:
      return is(0, height_px) && is(1, width_px) && is(2, 1);
    default:
      return false;
  }
}

[[noreturn]] void refuse_image(const py::array& array, int height_px, int width_px, const std::string& more) {
  refuse(Error::invalid("depth",
                        "an array of shape " + std::string(py::str(array.attr("shape"))) + " and dtype " +
                            std::string(py::str(array.dtype())),
                        "shape (" + std::to_string(height_px) + ", " + std::to_string(width_px) +
                            ") as the camera has it, and dtype uint16 (counts of camera.metres_per_count) or float32 "
                            "(metres)" +
                            more));
}

/// One that NumPy makes in memory of its own, or the same.
template <typename Value>
py::array converted(const py::array& array) {
  auto made = py::array_t<Value, kConverted>::ensure(array);
  if (!made) throw py::error_already_set();  // no memory
  return made;
}

}  // namespace

DepthImage to_depth(py::handle image, int height_px, int width_px) {
  auto array = py::reinterpret_borrow<py::object>(image);
  if (!py::isinstance<py::array>(array)) array = py::module_::import("numpy").attr("asarray")(array);
  const auto given = py::reinterpret_borrow<py::array>(array);
  if (!fits(given, height_px, width_px)) refuse_image(given, height_px, width_px, "");
  if (py::isinstance<py::array_t<std::uint16_t, kAsItLies>>(given)) return {given, true};
  if (py::isinstance<py::array_t<float, kAsItLies>>(given)) return {given, false};
  const char kind = given.dtype().kind();
  if (kind == 'u' && given.itemsize() == 2) return {converted<std::uint16_t>(given), true};
  if (kind == 'f') return {converted<float>(given), false};
  refuse_image(given, height_px, width_px, "; of these integers only you know the unit: .astype() to one of them");
}

}  // namespace gatefield::python
