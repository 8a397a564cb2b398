#pragma once

#include <pybind11/numpy.h>

#include "gatefield/sdk/client.h"

/// Depth images of Python: what becomes of their arrays.
namespace gatefield::python {

/// An image as the SDK takes it: its array is C-contiguous, in this machine's byte order, and kept alive.
struct DepthImage {
  pybind11::array array;
  bool counts = false;  ///< uint16 (CameraModel::metres_per_count); else float32, m
};

/// Taken as it lies, without a copy: uint16 and float32 in C order. Copied once: these in another order or byte order,
/// float16 and float64, and what only NumPy makes an array of. Shapes: (height, width), (height, width, 1) and
/// (height * width,).
/// Refuses everything else (gatefield.Invalid, field "depth"), and says shape and dtype.   Called with the GIL held.
DepthImage to_depth(pybind11::handle image, int height_px, int width_px);

}  // namespace gatefield::python
