#include "client/python/extension/files.h"

#include <string>

#include "client/python/extension/fields.h"
#include "client/python/extension/options.h"
#include "client/python/extension/refusal.h"
#include "common/config/course.h"
#include "common/config/locate.h"
#include "common/config/vehicle.h"

namespace gatefield::python {

namespace py = pybind11;

namespace {

/// A path, or the short name of one of the `kind`.
std::filesystem::path find(const std::string& kind, const py::object& name) {
  const auto path = py::reinterpret_steal<py::object>(PyOS_FSPath(name.ptr()));
  if (!path) throw py::error_already_set();
  return value_or_refuse(config::find_config(kind, to_text(path, "name")));
}

py::dict load_vehicle(const py::object& name) {
  const config::Vehicle vehicle = value_or_refuse(config::load_vehicle(find("vehicles", name)));
  py::list notes;
  for (const std::string& note : vehicle.notes) notes.append(text(note));
  py::dict made;
  made["title"] = text(vehicle.title);
  made["quadrotor"] = arguments(vehicle.quadrotor);
  made["actuation"] = arguments(vehicle.actuation);
  made["camera"] = arguments(vehicle.camera);
  made["notes"] = notes;
  return made;
}

py::dict load_track(const py::object& name) {
  const config::Track track = value_or_refuse(config::load_track(find("courses", name)));
  py::dict made;
  made["title"] = text(track.title);
  made["course"] = arguments(track.course);
  made["start_p_WB"] = tuple_of(track.start_p_WB);
  made["start_yaw_rad"] = track.start_yaw_rad;
  made["flight_volume"] = py::make_tuple(tuple_of(track.flight_volume.min()), tuple_of(track.flight_volume.max()));
  return made;
}

}  // namespace

void bind_files(py::module_* module) {
  module->def("load_vehicle", &load_vehicle);
  module->def("load_track", &load_track);
  module->def("config_folder", [] { return value_or_refuse(config::config_folder()).string(); });
}

}  // namespace gatefield::python
