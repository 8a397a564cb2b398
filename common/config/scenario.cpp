#include "common/config/scenario.h"

#include <cmath>
#include <numbers>

#include "common/base/random.h"
#include "common/base/text.h"
#include "common/config/locate.h"
#include "common/config/scenario.pb.h"
#include "common/config/sensor_noise_file.h"
#include "common/config/text_file.h"
#include "common/scene/furniture.h"

namespace gatefield::config {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

Status check(const char* field, double value, double low, double high, const char* unit) {
  if (value >= low && value <= high) return {};
  return Error::invalid(field, brief(value), brief(low) + " to " + brief(high) + unit);
}

// The files' numbers are the code's.
static_assert(DISCS == static_cast<int>(HullKind::kDiscs) && SPHERE == static_cast<int>(HullKind::kSphere));

Status first_failure(std::initializer_list<Status> checks) {
  for (const Status& status : checks)
    if (!status) return status;
  return {};
}

Status convert_actuation(const ScenarioFile& spec, Vehicle* vehicle) {
  if (!spec.has_actuation()) return {};
  const Actuation said = to_actuation(spec.actuation());
  const bool has_lags = spec.actuation().has_thrust_time_constant_s() || spec.actuation().has_rate_time_constant_s();
  vehicle->actuation = has_lags ? said : driven_by(*vehicle, said.kind);
  return validate(vehicle->actuation);
}

/// About where a course is flown: cubic curves (Hermite) from the start through the gates as they stand.
std::vector<Eigen::Vector3d> way_through(const Track& track, const scene::World& world) {
  constexpr int kPoints = 30;  // of each curve
  struct Knot {
    Eigen::Vector3d p_W, direction_W;
  };
  const Eigen::Vector3d heading_W(std::cos(track.start_yaw_rad), std::sin(track.start_yaw_rad), 0.0);
  std::vector<Knot> knots{{track.start_p_WB, heading_W}};
  for (const scene::Gate& gate : gates_by_waypoint(world, track.course))
    knots.push_back({gate.X_WG.translation(), gate.X_WG.linear().col(0)});
  if (track.course.closed) knots.push_back(knots[1]);
  std::vector<Eigen::Vector3d> way_W;
  for (std::size_t i = 1; i < knots.size(); ++i) {
    const Knot &from = knots[i - 1], &to = knots[i];
    const double length_m = (to.p_W - from.p_W).norm();
    for (int k = 0; k <= kPoints; ++k) {
      const double s = static_cast<double>(k) / kPoints, r = 1.0 - s;
      way_W.push_back(r * r * (1.0 + 2.0 * s) * from.p_W + s * s * (1.0 + 2.0 * r) * to.p_W +
                      length_m * s * r * (r * from.direction_W - s * to.direction_W));
    }
  }
  return way_W;
}

Status convert(const ScenarioFile& spec, Scenario* scenario) {
  scenario->title = spec.title();
  const PerturbationSpec& perturbation = spec.perturbation();
  scenario->perturbation = {perturbation.position_m(),
                            perturbation.has_height_m() ? perturbation.height_m() : 0.5 * perturbation.position_m(),
                            perturbation.yaw_deg() * kDegree, perturbation.tilt_deg() * kDegree, perturbation.exact()};
  if (auto status = validate(scenario->perturbation); !status) return status;
  scenario->hull = static_cast<HullKind>(spec.hull());
  if (auto status = validate(spec.sensor_noise()); !status) return status;
  scenario->sensor_noise = to_sensor_noise(spec.sensor_noise());
  if (auto status = validate(scenario->sensor_noise); !status) return status;
  if (spec.has_stereo()) {
    if (spec.has_sensor_noise() || spec.has_sensor_noise_file())
      return Error{"stereo and sensor_noise are both set, expected one: the pair of cameras makes its own noise",
                   ErrorCode::kInvalid, "stereo"};
    scene::StereoOptions options;
    if (spec.stereo().has_ambient()) options.ambient = spec.stereo().ambient();
    if (spec.stereo().has_lamp()) options.lamp = spec.stereo().lamp();
    if (spec.stereo().has_pattern()) options.pattern = spec.stereo().pattern();
    if (auto status = scene::validate(options); !status) return status;
    scenario->stereo = options;
  }
  const StateNoiseSpec& state = spec.state_noise();
  scenario->state_noise = {state.position_m(), state.velocity_m_s(), state.attitude_deg() * kDegree,
                           state.rate_rad_s()};
  if (auto status = validate(scenario->state_noise); !status) return status;
  const MismatchSpec& mismatch = spec.mismatch();
  scenario->mismatch = {
      mismatch.mass_factor(),
      mismatch.drag_factor(),
      mismatch.rotor_lag_factor(),
      {mismatch.wind_m_s().x(), mismatch.wind_m_s().y(), mismatch.wind_m_s().z()},
      mismatch.thrust_factor(),
      mismatch.rate_lag_factor(),
      from_seconds(1e-3 * mismatch.setpoint_delay_ms()),
      {mismatch.rate_limit_rad_s().x(), mismatch.rate_limit_rad_s().y(), mismatch.rate_limit_rad_s().z()}};
  if (auto status = validate(scenario->mismatch); !status) return status;
  if (auto status = convert_actuation(spec, &scenario->vehicle); !status) return status;
  if (auto status = validate(scenario->mismatch, scenario->vehicle.actuation); !status) return status;
  std::vector<WorldPart> parts;
  for (const int part : spec.world()) parts.push_back(static_cast<WorldPart>(part));
  auto hard = to_hard_world(parts, spec.world_sizes());
  if (!hard) return hard.failure();
  scenario->hard = std::move(hard).value();
  if (scenario->hard.camera_rate_hz > 0) scenario->vehicle.camera.rate_hz = scenario->hard.camera_rate_hz;
  if (spec.has_camera_rate_hz()) {
    scenario->vehicle.camera.rate_hz = spec.camera_rate_hz();
    if (auto status = validate(scenario->vehicle.camera); !status) return status;
  }
  scenario->seed = spec.seed();
  if (spec.has_planner_seed()) scenario->planner_seed = spec.planner_seed();
  if (auto status = check("time_limit_s", spec.time_limit_s(), 1, 86400, " s"); !status) return status;
  scenario->time_limit = from_seconds(spec.time_limit_s());
  return {};
}

}  // namespace

const std::map<std::string, HullKind>& hull_names() {
  static const std::map<std::string, HullKind> names{{"discs", HullKind::kDiscs}, {"sphere", HullKind::kSphere}};
  return names;
}

const char* name(HullKind kind) noexcept { return kind == HullKind::kDiscs ? "discs" : "sphere"; }

Status validate(const Perturbation& p) {
  return first_failure({check("perturbation.position_m", p.position_m, 0, 5, " m"),
                        check("perturbation.height_m", p.height_m, 0, p.exact ? p.position_m : 5.0,
                              p.exact ? " m, position_m at most, of which it is a part where exact is set" : " m"),
                        check("perturbation.yaw_deg", p.yaw_rad / kDegree, 0, 180, " degrees"),
                        check("perturbation.tilt_deg", p.tilt_rad / kDegree, 0, 60, " degrees")});
}

Status validate(const StateNoise& noise) {
  return first_failure({check("state_noise.position_m", noise.position_m, 0, 1, " m"),
                        check("state_noise.velocity_m_s", noise.velocity_m_s, 0, 5, " m/s"),
                        check("state_noise.attitude_deg", noise.attitude_rad / kDegree, 0, 45, " degrees"),
                        check("state_noise.rate_rad_s", noise.rate_rad_s, 0, 5, " rad/s")});
}

Status validate(const Mismatch& mismatch) {
  for (Eigen::Index i = 0; i < 3; ++i)
    if (const double limit = mismatch.rate_limit_rad_s[i]; limit != 0.0)
      if (auto status = check("mismatch.rate_limit_rad_s", limit, 0.2, 100, " rad/s, or 0 for none"); !status)
        return status;
  return first_failure({check("mismatch.mass_factor", mismatch.mass_factor, 0.2, 5, ""),
                        check("mismatch.drag_factor", mismatch.drag_factor, 0.2, 5, ""),
                        check("mismatch.rotor_lag_factor", mismatch.rotor_lag_factor, 0.2, 5, ""),
                        check("mismatch.wind_m_s", mismatch.wind_W_m_s.norm(), 0, 30, " m/s of length"),
                        check("mismatch.thrust_factor", mismatch.thrust_factor, 0.5, 2, ""),
                        check("mismatch.rate_lag_factor", mismatch.rate_lag_factor, 0.2, 5, ""),
                        check("mismatch.setpoint_delay_ms", 1e3 * seconds(mismatch.setpoint_delay), 0, 200, " ms")});
}

Status validate(const Mismatch& mismatch, const Actuation& actuation) {
  if (actuation.kind == Actuation::Kind::kBodyRates) return {};
  const std::string expected = " for a vehicle driven by rotor thrusts: it has no rate loop";
  if (mismatch.rate_lag_factor != 1.0)
    return Error::invalid("mismatch.rate_lag_factor", brief(mismatch.rate_lag_factor), "1" + expected);
  if (mismatch.setpoint_delay != Stamp{0})
    return Error::invalid("mismatch.setpoint_delay_ms", brief(1e3 * seconds(mismatch.setpoint_delay)), "0" + expected);
  if (!mismatch.rate_limit_rad_s.isZero(0.0))
    return Error::invalid("mismatch.rate_limit_rad_s", brief(mismatch.rate_limit_rad_s.maxCoeff()), "0" + expected);
  return {};
}

Result<Scenario> make_scenario(const std::filesystem::path& course_file, const std::filesystem::path& vehicle_file) {
  Scenario scenario;
  scenario.course_file = course_file;
  scenario.vehicle_file = vehicle_file;
  auto track = load_track(course_file);
  if (!track) return track.failure();
  auto vehicle = load_vehicle(vehicle_file);
  if (!vehicle) return vehicle.failure();
  scenario.track = *track;
  scenario.vehicle = *vehicle;
  return scenario;
}

Result<Scenario> load_scenario(const std::filesystem::path& file) {
  ScenarioFile spec;
  if (auto status = load_text(file, &spec); !status) return status.failure();
  return make_scenario(spec, file);
}

Result<Scenario> make_scenario(const ScenarioFile& spec, const std::filesystem::path& file) {
  const auto course_file = find_config("courses", spec.course(), file.parent_path());
  if (!course_file) return in_file(file, course_file.failure().within("course: "));
  const auto vehicle_file = find_config("vehicles", spec.vehicle(), file.parent_path());
  if (!vehicle_file) return in_file(file, vehicle_file.failure().within("vehicle: "));
  auto scenario = make_scenario(*course_file, *vehicle_file);
  if (!scenario) return scenario.failure();
  if (auto status = convert(spec, &scenario.value()); !status) return in_file(file, status.failure());
  if (spec.has_sensor_noise_file()) {
    if (spec.has_sensor_noise())
      return in_file(file, Error{"sensor_noise and sensor_noise_file are both set, expected one", ErrorCode::kInvalid,
                                 "sensor_noise"});
    const auto noise = load_sensor_noise(file.parent_path() / spec.sensor_noise_file());
    if (!noise) return in_file(file, noise.failure().within("sensor_noise_file: "));
    scenario.value().sensor_noise = *noise;
  }
  return scenario;
}

scene::World perturbed_world(const Track& track, const Perturbation& perturbation, std::uint64_t seed) {
  scene::World world = bare_world(track);
  Random random(seed, Stream("gatefield.perturbation"));
  // Drawn when it is not needed, too: one seed has the same ways and sides, exact or not.
  const auto magnitude = [&random, &perturbation] {
    const double side = random.chance(0.5) ? 1.0 : -1.0, part = random.uniform(0.5, 1.0);
    return side * (perturbation.exact ? 1.0 : part);
  };
  for (scene::Gate& gate : world.gates) {
    const double heading = random.uniform(0.0, 2.0 * std::numbers::pi);
    const double rise = random.uniform(-1.0, 1.0);
    const double yaw = perturbation.yaw_rad * magnitude();
    const double tilt_axis = random.uniform(0.0, 2.0 * std::numbers::pi);
    const double tilt = perturbation.tilt_rad * magnitude();

    Eigen::Vector3d p_WG = gate.X_WG.translation();
    double up_m = perturbation.height_m * rise, level_m = perturbation.position_m;
    if (perturbation.exact) {
      // What the floor takes of the way down goes to the side, so that the whole stays what it is.
      if (track.has_floor) up_m = std::max(up_m, track.floor_z_m + gate.shape.outer_half_m - p_WG.z());
      level_m = std::sqrt(std::max(0.0, level_m * level_m - up_m * up_m));
    }
    p_WG += level_m * Eigen::Vector3d(std::cos(heading), std::sin(heading), 0.0);
    p_WG.z() += up_m;
    if (track.has_floor) p_WG.z() = std::max(p_WG.z(), track.floor_z_m + gate.shape.outer_half_m);
    const Eigen::AngleAxisd turn(yaw, Eigen::Vector3d::UnitZ());
    const Eigen::AngleAxisd lean(tilt, Eigen::Vector3d(std::cos(tilt_axis), std::sin(tilt_axis), 0.0));
    const Eigen::Matrix3d R_WG = (lean * turn).toRotationMatrix() * gate.X_WG.linear();
    gate.X_WG.linear() = R_WG;
    gate.X_WG.translation() = p_WG;
  }
  furnish(track, &world);
  return world;
}

scene::World true_world(const Scenario& scenario) {
  scene::World world = perturbed_world(scenario.track, scenario.perturbation, scenario.seed);
  if (!scenario.hard.furniture) return world;
  scene::Hall hall{.room = scenario.track.flight_volume, .way_W = way_through(scenario.track, world)};
  if (scenario.track.has_floor) hall.room.min().z() = scenario.track.floor_z_m;
  Random random(scenario.seed, Stream("gatefield.furniture"));
  const std::vector<scene::Box> furniture = scene::furnish(hall, &random);
  world.boxes.insert(world.boxes.end(), furniture.begin(), furniture.end());
  return world;
}

QuadrotorModel true_quadrotor(const QuadrotorModel& believed, const Mismatch& mismatch) {
  QuadrotorModel model = believed;
  model.mass_kg *= mismatch.mass_factor;
  model.inertia_kg_m2 *= mismatch.mass_factor;
  model.drag_kg_s *= mismatch.drag_factor;
  model.rotor_time_constant_s *= mismatch.rotor_lag_factor;
  model.thrust_min_n *= mismatch.thrust_factor;
  model.thrust_max_n *= mismatch.thrust_factor;
  model.thrust_rate_max_n_s *= mismatch.thrust_factor;
  return model;
}

}  // namespace gatefield::config
