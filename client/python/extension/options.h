#pragma once

#include <pybind11/pybind11.h>

#include "common/course/course.h"
#include "common/geometry/camera.h"
#include "common/vehicle/actuation.h"
#include "common/vehicle/quadrotor.h"
#include "gatefield/sdk/client.h"

/// The classes of gatefield/options.py (and gatefield.State) against the SDK's structs: each field's name in one place.
/// All of it is called with the GIL held; what is no number, text or array of the right shape is gatefield.Invalid.
namespace gatefield::python {

/// Of gatefield.options.Options.
sdk::Options to_options(pybind11::handle options);
dds::NetworkOptions to_network(pybind11::handle network);
/// Of gatefield.State.
QuadrotorState to_state(pybind11::handle state);

/// The arguments of the Python classes.
pybind11::dict arguments(const QuadrotorModel& quadrotor);
pybind11::dict arguments(const Actuation& actuation);
pybind11::dict arguments(const CameraModel& camera);
pybind11::dict arguments(const GateShape& gate);
pybind11::dict arguments(const Waypoint& waypoint);  ///< its gate as its own arguments
pybind11::dict arguments(const Course& course);      ///< its waypoints as theirs

/// (rows, columns) as tuples of tuples, a vector as one tuple.
pybind11::tuple tuple_of(const Eigen::Ref<const Eigen::VectorXd>& vector);

}  // namespace gatefield::python
