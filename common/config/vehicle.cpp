#include "common/config/vehicle.h"

#include <algorithm>
#include <limits>
#include <numbers>

#include "common/base/text.h"
#include "common/config/text_file.h"
#include "common/config/vehicle.pb.h"

namespace gatefield::config {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

Result<CameraModel> to_camera(const CameraSpec& spec) {
  const bool has_fov = spec.has_horizontal_fov_deg() && spec.has_vertical_fov_deg();
  const bool has_focal = spec.has_fx_px() && spec.has_fy_px() && spec.has_cx_px() && spec.has_cy_px();
  const bool any_fov = spec.has_horizontal_fov_deg() || spec.has_vertical_fov_deg();
  const bool any_focal = spec.has_fx_px() || spec.has_fy_px() || spec.has_cx_px() || spec.has_cy_px();
  if (has_fov == has_focal || (any_fov && any_focal))
    return Error{
        "camera has " +
            std::string(any_fov && any_focal ? "both fields of view and focal lengths" : "an incomplete lens") +
            ", expected either horizontal_fov_deg and vertical_fov_deg, or fx_px, fy_px, cx_px and cy_px",
        ErrorCode::kInvalid, "camera"};
  CameraModel camera;
  if (has_fov) {
    for (const auto& [name, value] : {std::pair("horizontal_fov_deg", spec.horizontal_fov_deg()),
                                      std::pair("vertical_fov_deg", spec.vertical_fov_deg())})
      if (!(value >= 5 && value <= 160))
        return Error::invalid(std::string("camera.") + name, text(value), "5 to 160 degrees");
    camera = camera_from_fov(spec.width_px(), spec.height_px(), spec.horizontal_fov_deg() * kDegree,
                             spec.vertical_fov_deg() * kDegree);
  } else {
    camera.width_px = spec.width_px();
    camera.height_px = spec.height_px();
    camera.fx_px = spec.fx_px();
    camera.fy_px = spec.fy_px();
    camera.cx_px = spec.cx_px();
    camera.cy_px = spec.cy_px();
  }
  camera.min_depth_m = spec.min_depth_m();
  camera.max_depth_m = spec.max_depth_m();
  camera.rate_hz = spec.rate_hz();
  camera.metres_per_count = spec.metres_per_count();
  const DistortionSpec& lens = spec.distortion();
  camera.distortion = {lens.k1(), lens.k2(), lens.p1(), lens.p2(), lens.k3()};
  if (lens.model() == DistortionSpec::BROWN_CONRADY) {
    camera.distortion_model = CameraModel::Distortion::kBrownConrady;
  } else if (camera.distortion != CameraModel().distortion) {
    return Error::invalid("camera.distortion.model", "NONE", "BROWN_CONRADY beside coefficients other than 0");
  }

  const MountSpec& mount = spec.mount();
  const Eigen::Isometry3d X_BC_level = forward_camera_mount(mount.pitch_up_deg() * kDegree);
  camera.X_BC.linear() =
      Eigen::AngleAxisd(mount.yaw_left_deg() * kDegree, Eigen::Vector3d::UnitZ()).toRotationMatrix() *
      X_BC_level.linear() * Eigen::AngleAxisd(mount.roll_deg() * kDegree, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  camera.X_BC.translation() = Eigen::Vector3d(mount.x_m(), mount.y_m(), mount.z_m());
  if (auto status = validate(camera); !status) return status.failure();
  return camera;
}

Result<QuadrotorModel> to_quadrotor(const QuadrotorSpec& spec, std::vector<std::string>* notes) {
  if (spec.rotor_size() != kRotors)
    return Error::invalid("quadrotor.rotor", "given " + text(spec.rotor_size()) + " times", "exactly " + text(kRotors));
  QuadrotorModel model;
  model.mass_kg = spec.mass_kg();
  model.inertia_kg_m2 = {spec.inertia_kg_m2().xx(), spec.inertia_kg_m2().yy(), spec.inertia_kg_m2().zz()};
  for (std::size_t i = 0; i < kRotors; ++i) {
    const RotorSpec& rotor = spec.rotor(static_cast<int>(i));
    model.rotor_position_B_m[i] = {rotor.x_m(), rotor.y_m()};
    model.rotor_spin[i] = rotor.torque_sign();
  }
  model.torque_per_thrust_m = spec.torque_per_thrust_m();
  model.thrust_min_n = spec.thrust_min_n();
  model.thrust_max_n = spec.thrust_max_n();
  model.thrust_rate_max_n_s = spec.thrust_rate_max_n_s();
  model.rotor_time_constant_s = spec.rotor_time_constant_s();
  model.drag_kg_s = {spec.drag_kg_s().x(), spec.drag_kg_s().y(), spec.drag_kg_s().z()};
  model.collision_radius_m = spec.collision_radius_m();
  const auto& rates = spec.body_rate_max_rad_s();
  model.body_rate_max_rad_s = {rates.x(), rates.y(), rates.z()};
  if (auto note = mend_inertia(&model)) notes->push_back("quadrotor." + *note);
  if (auto status = validate(model); !status) return status.failure();
  return model;
}

/// Half of the shortest way between two rotors.
double propeller_room_m(const QuadrotorModel& model) {
  double shortest_m = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < kRotors; ++i)
    for (std::size_t j = 0; j < i; ++j)
      shortest_m = std::min(shortest_m, (model.rotor_position_B_m[i] - model.rotor_position_B_m[j]).norm());
  return 0.5 * shortest_m;
}

Result<double> to_propeller_radius_m(const QuadrotorSpec& spec, const QuadrotorModel& model) {
  if (!spec.has_propeller_radius_m()) return usual_propeller_radius_m(model);
  double arm_m = 0.0;
  for (const PlainVector2& rotor_B : model.rotor_position_B_m) arm_m = std::max(arm_m, rotor_B.norm());
  const double radius_m = spec.propeller_radius_m(), least_m = 0.1 * arm_m, most_m = propeller_room_m(model);
  if (radius_m >= least_m && radius_m <= most_m) return radius_m;
  return Error::invalid("quadrotor.propeller_radius_m", text(radius_m),
                        text(least_m) + " to " + text(most_m) +
                            " m, a tenth of the longest arm to half of the shortest way between two rotors");
}

}  // namespace

double usual_propeller_radius_m(const QuadrotorModel& model) { return kUsualPropeller * propeller_room_m(model); }

Actuation to_actuation(const ActuationSpec& spec) {
  Actuation actuation;
  actuation.kind =
      spec.kind() == ActuationSpec::BODY_RATES ? Actuation::Kind::kBodyRates : Actuation::Kind::kRotorThrusts;
  actuation.thrust_time_constant_s = spec.thrust_time_constant_s();
  const auto& lags = spec.rate_time_constant_s();
  actuation.rate_time_constant_s = Eigen::Vector3d(lags.x(), lags.y(), lags.z());
  return actuation;
}

const std::map<std::string, Actuation::Kind>& actuation_names() {
  static const std::map<std::string, Actuation::Kind> names{{"rotor-thrusts", Actuation::Kind::kRotorThrusts},
                                                            {"body-rates", Actuation::Kind::kBodyRates}};
  return names;
}

Actuation driven_by(const Vehicle& vehicle, Actuation::Kind kind) {
  if (vehicle.actuation.kind == kind) return vehicle.actuation;
  Actuation actuation;
  actuation.kind = kind;
  if (kind == Actuation::Kind::kBodyRates) {
    const double rotors_s = vehicle.quadrotor.rotor_time_constant_s;
    actuation.thrust_time_constant_s = rotors_s;
    actuation.rate_time_constant_s = rotors_s * Eigen::Vector3d(1.7, 1.7, 3.2);
  }
  return actuation;
}

Result<Vehicle> load_vehicle(const std::filesystem::path& file) {
  VehicleFile spec;
  if (auto status = load_text(file, &spec); !status) return status.failure();
  Vehicle vehicle;
  vehicle.title = spec.title();
  auto quadrotor = to_quadrotor(spec.quadrotor(), &vehicle.notes);
  if (!quadrotor) return in_file(file, quadrotor.failure());
  auto camera = to_camera(spec.camera());
  if (!camera) return in_file(file, camera.failure());
  auto propeller_radius_m = to_propeller_radius_m(spec.quadrotor(), *quadrotor);
  if (!propeller_radius_m) return in_file(file, propeller_radius_m.failure());
  vehicle.quadrotor = *quadrotor;
  vehicle.propeller_radius_m = *propeller_radius_m;
  vehicle.camera = *camera;
  vehicle.actuation = to_actuation(spec.actuation());
  if (auto status = validate(vehicle.actuation); !status) return in_file(file, status.failure());
  for (std::string& note : vehicle.notes) note = file.string() + ": " + note;
  return vehicle;
}

}  // namespace gatefield::config
