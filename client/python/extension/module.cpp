// _gatefield: the SDK as Python sees it. The package gatefield around it is what people use.
#include <pybind11/pybind11.h>

#include <atomic>
#include <vector>

#include "client/python/extension/client.h"
#include "client/python/extension/fields.h"
#include "client/python/extension/files.h"
#include "client/python/extension/options.h"
#include "client/python/extension/process.h"
#include "client/python/extension/refusal.h"
#include "client/python/extension/results.h"
#include "gatefield/sdk/servers.h"

namespace gatefield::python {

namespace py = pybind11;

namespace {

constexpr double kLongestListening_s = 600.0;

py::list find_servers(const py::object& domain, const py::object& wait, const py::object& network) {
  const auto number = static_cast<std::uint32_t>(to_count(domain, "domain", UINT32_MAX));
  const dds::NetworkOptions ways = to_network(network);
  const double wait_s = to_number(wait, "wait_s");
  if (!(wait_s >= 0.0 && wait_s <= kLongestListening_s))
    refuse(Error::invalid("wait_s", py::str(wait), "0 to 600 seconds"));
  const auto listening = std::chrono::duration_cast<std::chrono::milliseconds>(from_seconds(wait_s));
  use_network();
  using Found = Result<std::vector<protocol::ServerStatus>>;
  auto found = interruptible<Found>(
      [&](const std::atomic<bool>* cancel) { return sdk::find_servers(number, ways, listening, cancel); });
  py::list servers;
  for (const protocol::ServerStatus& server : value_or_refuse(std::move(found))) servers.append(server);
  return servers;
}

}  // namespace
}  // namespace gatefield::python

PYBIND11_MODULE(_gatefield, module) {
  using namespace gatefield;
  using namespace gatefield::python;
  module.attr("__version__") = GATEFIELD_VERSION;
  module.attr("WIRE_VERSION") = protocol::kVersion;
  bind_results(&module);
  bind_client(&module);
  bind_files(&module);
  module.def("find_servers", &find_servers);
  module.def("default_quadrotor", [] { return arguments(QuadrotorModel{}); });
  module.def("default_actuation", [] { return arguments(Actuation{}); });
  module.def("default_camera", [] { return arguments(default_camera()); });
  module.def("default_gate", [] { return arguments(GateShape{}); });
  module.def("camera_from_fov", [](int width_px, int height_px, double horizontal_rad, double vertical_rad) {
    return arguments(gatefield::camera_from_fov(width_px, height_px, horizontal_rad, vertical_rad));
  });
  module.def("forward_camera_mount", [](double pitch_up_rad, const pybind11::object& p_BC) {
    const auto place = to_array(p_BC, "p_BC", {3});
    CameraModel camera;
    camera.X_BC = forward_camera_mount(pitch_up_rad, Eigen::Map<const Eigen::Vector3d>(place.data()));
    return arguments(camera)["X_BC"].cast<pybind11::object>();
  });
}
