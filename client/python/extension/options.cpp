#include "client/python/extension/options.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

#include "client/python/extension/fields.h"
#include "client/python/extension/refusal.h"

namespace gatefield::python {

namespace py = pybind11;

namespace {

// In the order of the enumerations.
const std::vector<std::string> kTimings{"real_time", "lockstep"};
const std::vector<std::string> kActuations{"rotor_thrusts", "body_rates"};
const std::vector<std::string> kOpenings{"square", "round"};
const std::vector<std::string> kDistortions{"none", "brown_conrady"};

constexpr double kLongestTimeout_s = 3600.0;

QuadrotorModel to_quadrotor(py::handle object) {
  const Fields fields(object, "quadrotor");
  QuadrotorModel quadrotor;
  quadrotor.mass_kg = fields.number("mass_kg");
  quadrotor.inertia_kg_m2 = fields.vector<3>("inertia_kg_m2");
  const auto places = to_array(fields.get("rotor_position_B_m"), fields.path("rotor_position_B_m"), {kRotors, 2});
  for (int i = 0; i < kRotors; ++i) quadrotor.rotor_position_B_m[i] = {places.at(i, 0), places.at(i, 1)};
  const PlainVector4 spin = fields.vector<kRotors>("rotor_spin");
  for (int i = 0; i < kRotors; ++i) {
    if (std::abs(spin[i]) != 1.0)
      refuse(Error::invalid(fields.path("rotor_spin"), std::string(py::str(fields.get("rotor_spin"))),
                            "a sign, 1 or -1, for each of the four rotors"));
    quadrotor.rotor_spin[i] = spin[i] > 0 ? 1 : -1;
  }
  quadrotor.torque_per_thrust_m = fields.number("torque_per_thrust_m");
  quadrotor.thrust_min_n = fields.number("thrust_min_n");
  quadrotor.thrust_max_n = fields.number("thrust_max_n");
  quadrotor.thrust_rate_max_n_s = fields.number("thrust_rate_max_n_s");
  quadrotor.rotor_time_constant_s = fields.number("rotor_time_constant_s");
  quadrotor.drag_kg_s = fields.vector<3>("drag_kg_s");
  quadrotor.collision_radius_m = fields.number("collision_radius_m");
  quadrotor.body_rate_max_rad_s = fields.vector<3>("body_rate_max_rad_s");
  return quadrotor;
}

Actuation to_actuation(py::handle object) {
  const Fields fields(object, "actuation");
  Actuation actuation;
  actuation.kind = static_cast<Actuation::Kind>(fields.choice("kind", kActuations));
  actuation.thrust_time_constant_s = fields.number("thrust_time_constant_s");
  actuation.rate_time_constant_s = fields.vector<3>("rate_time_constant_s");
  return actuation;
}

CameraModel to_camera(py::handle object) {
  const Fields fields(object, "camera");
  constexpr std::uint64_t kMostPixels = 1u << 16;  // the SDK says what it takes
  CameraModel camera;
  camera.width_px = static_cast<int>(fields.count("width_px", kMostPixels));
  camera.height_px = static_cast<int>(fields.count("height_px", kMostPixels));
  camera.fx_px = fields.number("fx_px");
  camera.fy_px = fields.number("fy_px");
  camera.cx_px = fields.number("cx_px");
  camera.cy_px = fields.number("cy_px");
  camera.min_depth_m = fields.number("min_depth_m");
  camera.max_depth_m = fields.number("max_depth_m");
  camera.rate_hz = fields.number("rate_hz");
  const auto X_BC = to_array(fields.get("X_BC"), fields.path("X_BC"), {4, 4});
  const Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>> matrix(X_BC.data());
  if (matrix.row(3) != Eigen::RowVector4d(0, 0, 0, 1))
    refuse(Error::invalid(fields.path("X_BC"), std::string(py::str(fields.get("X_BC"))), "a last row of (0, 0, 0, 1)"));
  camera.X_BC.matrix() = matrix;
  camera.metres_per_count = fields.number("metres_per_count");
  camera.distortion_model = static_cast<CameraModel::Distortion>(fields.choice("distortion_model", kDistortions));
  const auto distortion = fields.vector<5>("distortion");
  std::copy_n(distortion.data(), camera.distortion.size(), camera.distortion.begin());
  return camera;
}

GateShape to_gate(py::handle object, const std::string& path) {
  const Fields fields(object, path);
  GateShape gate;
  gate.opening = static_cast<GateShape::Opening>(fields.choice("opening", kOpenings));
  gate.inner_half_m = fields.number("inner_half_m");
  gate.outer_half_m = fields.number("outer_half_m");
  gate.thickness_m = fields.number("thickness_m");
  return gate;
}

Course to_course(py::handle object) {
  const Fields fields(object, "course");
  Course course;
  for (const py::object& waypoint : fields.objects("waypoints")) {
    const std::string path = "course.waypoints[" + std::to_string(course.waypoints.size()) + "]";
    const Fields one(waypoint, path);
    course.waypoints.emplace_back(one.vector<3>("p_W"), one.vector<3>("direction_W"),
                                  to_gate(one.get("gate"), path + ".gate"),
                                  static_cast<std::uint32_t>(one.count("gate_id", UINT32_MAX)));
  }
  course.laps = static_cast<int>(fields.count("laps", INT32_MAX));
  course.closed = fields.flag("closed");
  if (const py::object floor = fields.get("floor_z_m"); !floor.is_none())
    course.floor_z_m = to_number(floor, "course.floor_z_m");
  return course;
}

template <typename Enumeration>
const char* name_of(const std::vector<std::string>& names, Enumeration value) {
  return names[static_cast<std::size_t>(value)].c_str();
}

}  // namespace

py::tuple tuple_of(const Eigen::Ref<const Eigen::VectorXd>& vector) {
  py::tuple tuple(static_cast<std::size_t>(vector.size()));
  for (Eigen::Index i = 0; i < vector.size(); ++i) tuple[static_cast<std::size_t>(i)] = vector[i];
  return tuple;
}

dds::NetworkOptions to_network(py::handle object) {
  const Fields fields(object, "network");
  dds::NetworkOptions network;
  network.peers = fields.texts("peers");
  network.interfaces = fields.texts("interfaces");
  network.discovery_servers = fields.texts("discovery_servers");
  network.shared_memory = fields.flag("shared_memory");
  network.security = fields.text("security");
  return network;
}

sdk::Options to_options(py::handle object) {
  const Fields fields(object, "");
  sdk::Options options;
  options.domain = static_cast<std::uint32_t>(fields.count("domain", UINT32_MAX));
  options.vehicle = fields.text("vehicle");
  options.server = fields.text("server");
  options.profile = fields.text("profile");
  options.timing = static_cast<protocol::Timing>(fields.choice("timing", kTimings));
  options.seed = fields.count("seed", UINT64_MAX);
  options.speed_limit_m_s = fields.number("speed_limit_m_s");
  options.priority = static_cast<std::uint8_t>(fields.count("priority", protocol::kMaxPriority));
  options.quadrotor = to_quadrotor(fields.get("quadrotor"));
  options.actuation = to_actuation(fields.get("actuation"));
  options.camera = to_camera(fields.get("camera"));
  options.course = to_course(fields.get("course"));
  const double timeout_s = fields.number("timeout_s");
  if (!(timeout_s >= 0.0 && timeout_s <= kLongestTimeout_s))
    refuse(Error::invalid("timeout_s", std::string(py::str(fields.get("timeout_s"))), "0 to 3600 seconds"));
  options.connect_timeout = std::chrono::duration_cast<std::chrono::milliseconds>(from_seconds(timeout_s));
  options.network = to_network(fields.get("network"));
  return options;
}

QuadrotorState to_state(py::handle object) {
  const Fields fields(object, "state");
  QuadrotorState state;
  state.p_WB = fields.vector<3>("p_WB");
  state.v_WB = fields.vector<3>("v_WB");
  const PlainVector4 wxyz = fields.vector<4>("q_WB_wxyz");
  state.q_WB = PlainQuaternion(wxyz[0], wxyz[1], wxyz[2], wxyz[3]);
  state.w_WB_B = fields.vector<3>("w_WB_B");
  state.thrust_n = fields.vector<4>("thrust_n");
  state.thrust_command_n = fields.vector<4>("thrust_command_n");
  return state;
}

py::dict arguments(const QuadrotorModel& quadrotor) {
  py::tuple places(kRotors), spin(kRotors);
  for (std::size_t i = 0; i < kRotors; ++i) {
    places[i] = tuple_of(quadrotor.rotor_position_B_m[i]);
    spin[i] = quadrotor.rotor_spin[i];
  }
  py::dict made;
  made["mass_kg"] = quadrotor.mass_kg;
  made["inertia_kg_m2"] = tuple_of(quadrotor.inertia_kg_m2);
  made["rotor_position_B_m"] = places;
  made["rotor_spin"] = spin;
  made["torque_per_thrust_m"] = quadrotor.torque_per_thrust_m;
  made["thrust_min_n"] = quadrotor.thrust_min_n;
  made["thrust_max_n"] = quadrotor.thrust_max_n;
  made["thrust_rate_max_n_s"] = quadrotor.thrust_rate_max_n_s;
  made["rotor_time_constant_s"] = quadrotor.rotor_time_constant_s;
  made["drag_kg_s"] = tuple_of(quadrotor.drag_kg_s);
  made["collision_radius_m"] = quadrotor.collision_radius_m;
  made["body_rate_max_rad_s"] = tuple_of(quadrotor.body_rate_max_rad_s);
  return made;
}

py::dict arguments(const Actuation& actuation) {
  py::dict made;
  made["kind"] = name_of(kActuations, actuation.kind);
  made["thrust_time_constant_s"] = actuation.thrust_time_constant_s;
  made["rate_time_constant_s"] = tuple_of(actuation.rate_time_constant_s);
  return made;
}

py::dict arguments(const CameraModel& camera) {
  py::tuple rows(4);
  for (std::size_t row = 0; row < 4; ++row)
    rows[row] = tuple_of(camera.X_BC.matrix().row(static_cast<Eigen::Index>(row)).transpose());
  py::dict made;
  made["width_px"] = camera.width_px;
  made["height_px"] = camera.height_px;
  made["fx_px"] = camera.fx_px;
  made["fy_px"] = camera.fy_px;
  made["cx_px"] = camera.cx_px;
  made["cy_px"] = camera.cy_px;
  made["min_depth_m"] = camera.min_depth_m;
  made["max_depth_m"] = camera.max_depth_m;
  made["rate_hz"] = camera.rate_hz;
  made["X_BC"] = rows;
  made["metres_per_count"] = camera.metres_per_count;
  made["distortion_model"] = name_of(kDistortions, camera.distortion_model);
  made["distortion"] = tuple_of(Eigen::Map<const Eigen::VectorXd>(camera.distortion.data(), Eigen::Index{5}));
  return made;
}

py::dict arguments(const GateShape& gate) {
  py::dict made;
  made["opening"] = name_of(kOpenings, gate.opening);
  made["inner_half_m"] = gate.inner_half_m;
  made["outer_half_m"] = gate.outer_half_m;
  made["thickness_m"] = gate.thickness_m;
  return made;
}

py::dict arguments(const Waypoint& waypoint) {
  py::dict made;
  made["p_W"] = tuple_of(waypoint.p_W);
  made["direction_W"] = tuple_of(waypoint.direction_W);
  made["gate"] = arguments(waypoint.gate);
  made["gate_id"] = waypoint.gate_id;
  return made;
}

py::dict arguments(const Course& course) {
  py::list waypoints;
  for (const Waypoint& waypoint : course.waypoints) waypoints.append(arguments(waypoint));
  py::dict made;
  made["waypoints"] = waypoints;
  made["laps"] = course.laps;
  made["closed"] = course.closed;
  made["floor_z_m"] = course.floor_z_m ? py::object(py::float_(*course.floor_z_m)) : py::object(py::none());
  return made;
}

}  // namespace gatefield::python
