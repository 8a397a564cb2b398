#include "common/config/course.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/base/text.h"
#include "common/config/course.pb.h"
#include "common/config/gate_spec.h"
#include "common/config/text_file.h"

namespace gatefield::config {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kMaxCoordinate_m = 10000.0;

Eigen::Vector3d to_vector(const Vector& v) { return {v.x(), v.y(), v.z()}; }

Status check_number(const std::string& field, double value, double low, double high, const std::string& unit) {
  if (value >= low && value <= high) return {};
  return Error::invalid(field, brief(value), brief(low) + " to " + brief(high) + unit);
}

Status check_point(const std::string& field, const Eigen::Vector3d& p) {
  if (p.allFinite() && p.cwiseAbs().maxCoeff() <= kMaxCoordinate_m) return {};
  return Error::invalid(field, text(p), "finite coordinates within 10 km");
}

Status check_gate(const std::string& field, const GateSpec& spec) {
  if (auto status = validate(to_shape(spec)); !status) return status.failure().within(field, field);
  if (spec.has_leg_width_m())
    if (auto status = check_number(field + "gate.leg_width_m", spec.leg_width_m(), 0.005, spec.outer_half_m(), " m");
        !status)
      return status;
  return check_number(field + "gate.reflectance", spec.reflectance(), 0, 1, "");
}

Status add_waypoint(const WaypointSpec& spec, const std::string& field, const GateSpec& gate, Track* track) {
  Waypoint waypoint;
  waypoint.p_W = to_vector(spec.position());
  if (auto status = check_point(field + ".position", waypoint.p_W); !status) return status;
  if (spec.has_yaw_deg() && spec.has_direction())
    return Error{field + " has both yaw_deg and direction, expected at most one of them", ErrorCode::kInvalid, field};
  if (spec.has_yaw_deg()) {
    if (auto status = check_number(field + ".yaw_deg", spec.yaw_deg(), -360, 360, " degrees"); !status) return status;
    waypoint.direction_W = {std::cos(spec.yaw_deg() * kDegree), std::sin(spec.yaw_deg() * kDegree), 0};
  } else if (spec.has_direction()) {
    const Eigen::Vector3d direction = to_vector(spec.direction());
    if (!(direction.allFinite() && direction.norm() > 1e-6))
      return Error::invalid(field + ".direction", text(direction), "a finite vector that is not zero");
    waypoint.direction_W = direction.normalized();
  }
  if (spec.has_gate() && spec.has_opening())
    return Error{field + " has both opening and gate, expected at most one of them: a gate says its opening itself",
                 ErrorCode::kInvalid, field};
  waypoint.gate = to_shape(spec.has_gate() ? spec.gate() : gate);
  if (spec.has_opening()) waypoint.gate.opening = to_opening(spec.opening());
  if (spec.has_gate())
    if (auto status = check_gate(field + ".", spec.gate()); !status) return status;
  waypoint.gate_id = spec.gate_id();
  track->course.waypoints.push_back(waypoint);
  track->leg_width_m.push_back((spec.has_gate() ? spec.gate() : gate).leg_width_m());
  track->gate_reflectance.push_back(
      static_cast<float>(spec.gate().has_reflectance() ? spec.gate().reflectance() : gate.reflectance()));
  return {};
}

/// Could these two be passages of one gate? As validate(Course) has it of waypoints that name one: the same place,
/// shape and axis, either way.
bool same_gate(Waypoint a, Waypoint b) {
  a.gate_id = b.gate_id = 1;
  Course both;
  both.waypoints = {a, b};
  return validate(both).ok();
}

/// A number that no waypoint names a gate by.
std::uint32_t unused_id(const std::vector<Waypoint>& waypoints) {
  std::uint32_t id = 1;
  while (std::any_of(waypoints.begin(), waypoints.end(), [id](const Waypoint& w) { return w.gate_id == id; })) ++id;
  return id;
}

/// Gives waypoints without an id that share a place, shape and axis with an earlier one that waypoint's gate.
void name_shared_gates(std::vector<Waypoint>* waypoints) {
  for (std::size_t i = 1; i < waypoints->size(); ++i) {
    Waypoint& waypoint = (*waypoints)[i];
    if (waypoint.gate_id != 0) continue;
    const auto end = waypoints->begin() + static_cast<std::ptrdiff_t>(i);
    const auto first =
        std::find_if(waypoints->begin(), end, [&](const Waypoint& earlier) { return same_gate(earlier, waypoint); });
    if (first == end) continue;
    if (first->gate_id == 0) first->gate_id = unused_id(*waypoints);
    waypoint.gate_id = first->gate_id;
  }
}

Status add_clutter(const CourseFile& spec, std::vector<scene::Box>* clutter) {
  for (int i = 0; i < spec.box_size(); ++i) {
    const BoxSpec& box = spec.box(i);
    const std::string field = "box[" + std::to_string(i) + "]";
    scene::Box out;
    const Eigen::Vector3d size = to_vector(box.size());
    if (auto status = check_point(field + ".center", to_vector(box.center())); !status) return status;
    if (!(size.allFinite() && size.minCoeff() >= 0.01 && size.maxCoeff() <= 1000))
      return Error::invalid(field + ".size", text(size), "edge lengths of 0.01 to 1000 m");
    if (auto status = check_number(field + ".yaw_deg", box.yaw_deg(), -360, 360, " degrees"); !status) return status;
    if (auto status = check_number(field + ".reflectance", box.reflectance(), 0, 1, ""); !status) return status;
    out.X_WO.linear() = Eigen::AngleAxisd(box.yaw_deg() * kDegree, Eigen::Vector3d::UnitZ()).toRotationMatrix();
    out.X_WO.translation() = to_vector(box.center());
    out.half_m = 0.5 * size;
    out.reflectance = static_cast<float>(box.reflectance());
    clutter->push_back(out);
  }
  for (int i = 0; i < spec.pole_size(); ++i) {
    const PoleSpec& pole = spec.pole(i);
    const std::string field = "pole[" + std::to_string(i) + "]";
    if (auto status = check_point(field, {pole.x(), pole.y(), pole.z_bottom()}); !status) return status;
    if (auto status = check_number(field + ".height", pole.height(), 0.01, 1000, " m"); !status) return status;
    if (auto status = check_number(field + ".width", pole.width(), 0.01, 100, " m"); !status) return status;
    if (auto status = check_number(field + ".reflectance", pole.reflectance(), 0, 1, ""); !status) return status;
    scene::Box out;
    out.X_WO.translation() = Eigen::Vector3d(pole.x(), pole.y(), pole.z_bottom() + 0.5 * pole.height());
    out.half_m = {0.5 * pole.width(), 0.5 * pole.width(), 0.5 * pole.height()};
    out.reflectance = static_cast<float>(pole.reflectance());
    clutter->push_back(out);
  }
  return {};
}

Status check_places(const Track& track) {
  const auto& volume = track.flight_volume;
  const std::string range = text(volume.min()) + " to " + text(volume.max());
  for (std::size_t i = 0; i < track.course.waypoints.size(); ++i) {
    const Eigen::Vector3d& p_W = track.course.waypoints[i].p_W;
    const std::string field = "waypoint[" + std::to_string(i) + "].position";
    if (!volume.contains(p_W)) return Error::invalid(field, text(p_W), "a place in the flight volume, " + range);
    const double outer_half_m = track.course.waypoints[i].gate.outer_half_m;
    const double lowest_m = p_W.z() - outer_half_m;
    if (track.has_floor && lowest_m < track.floor_z_m - 1e-9)
      return Error::invalid(field, text(p_W),
                            "z of at least " + text(track.floor_z_m + outer_half_m) +
                                " m, so that the gate stands on the floor or above");
  }
  if (!volume.contains(track.start_p_WB))
    return Error::invalid("start.position", text(track.start_p_WB), "a place in the flight volume, " + range);
  if (track.has_floor && track.start_p_WB.z() <= track.floor_z_m)
    return Error::invalid("start.position", text(track.start_p_WB),
                          "a place above the floor at z = " + text(track.floor_z_m) + " m");
  return {};
}

Status convert(const CourseFile& spec, Track* track) {
  track->title = spec.title();
  if (spec.waypoint_size() < 1 || spec.waypoint_size() > kMaxWaypoints)
    return Error::invalid("waypoint", "given " + text(spec.waypoint_size()) + " times", "1 to " + text(kMaxWaypoints));
  if (auto status = check_gate("", spec.gate()); !status) return status;
  for (int i = 0; i < spec.waypoint_size(); ++i)
    if (auto status = add_waypoint(spec.waypoint(i), "waypoint[" + std::to_string(i) + "]", spec.gate(), track);
        !status)
      return status;
  if (auto status = check_number("laps", spec.laps(), 1, kMaxLaps, ""); !status) return status;
  track->course.laps = spec.laps();
  track->course.closed = spec.closed();
  for (std::size_t i = 0; i < track->course.waypoints.size(); ++i) {
    auto& waypoint = track->course.waypoints[i];
    if (waypoint.direction_W.isZero()) waypoint.direction_W = passing_direction(track->course, i);
    if (waypoint.direction_W.isZero())
      return Error{"waypoint[" + std::to_string(i) +
                       "] has no neighbours to take its direction from, expected yaw_deg or direction",
                   ErrorCode::kInvalid, "waypoint[" + std::to_string(i) + "]"};
  }
  name_shared_gates(&track->course.waypoints);
  track->has_floor = spec.has_floor();
  if (track->has_floor) {
    if (auto status = check_number("floor.z", spec.floor().z(), -kMaxCoordinate_m, kMaxCoordinate_m, " m"); !status)
      return status;
    if (auto status = check_number("floor.reflectance", spec.floor().reflectance(), 0, 1, ""); !status) return status;
    track->floor_z_m = spec.floor().z();
    track->course.floor_z_m = track->floor_z_m;
    track->floor_reflectance = static_cast<float>(spec.floor().reflectance());
  }
  for (std::size_t i = 0; i < track->leg_width_m.size() && !track->has_floor; ++i)
    if (track->leg_width_m[i] > 0)
      return Error{"waypoint[" + std::to_string(i) + "] has a gate with leg_width_m, expected a floor to stand on",
                   ErrorCode::kInvalid, "waypoint[" + std::to_string(i) + "].gate.leg_width_m"};
  if (auto status = validate(track->course); !status) return status;

  track->start_p_WB = to_vector(spec.start().position());
  if (auto status = check_point("start.position", track->start_p_WB); !status) return status;
  if (auto status = check_number("start.yaw_deg", spec.start().yaw_deg(), -360, 360, " degrees"); !status)
    return status;
  track->start_yaw_rad = spec.start().yaw_deg() * kDegree;

  const Eigen::Vector3d low = to_vector(spec.flight_volume().min());
  const Eigen::Vector3d high = to_vector(spec.flight_volume().max());
  if (auto status = check_point("flight_volume.min", low); !status) return status;
  if (auto status = check_point("flight_volume.max", high); !status) return status;
  if (!((high - low).minCoeff() >= 0.5))
    return Error::invalid("flight_volume.max", text(high),
                          "every coordinate at least 0.5 m above flight_volume.min, " + text(low));
  track->flight_volume = Eigen::AlignedBox3d(low, high);

  if (auto status = add_clutter(spec, &track->clutter); !status) return status;
  return check_places(*track);
}

}  // namespace

scene::World bare_world(const Track& track) {
  scene::World world;
  for (std::size_t i = 0; i < track.course.waypoints.size(); ++i) {
    if (gate_index(track.course, i) < world.gates.size()) continue;  // it stands there already
    const float reflectance = i < track.gate_reflectance.size() ? track.gate_reflectance[i] : scene::Gate{}.reflectance;
    world.gates.push_back({gate_pose(track.course.waypoints[i].p_W, passing_direction(track.course, i)),
                           track.course.waypoints[i].gate, reflectance});
  }
  world.has_floor = track.has_floor;
  world.floor_z_m = track.floor_z_m;
  world.floor_reflectance = track.floor_reflectance;
  return world;
}

void furnish(const Track& track, scene::World* world) {
  world->boxes = track.clutter;
  std::size_t standing = 0;
  for (std::size_t i = 0; i < track.leg_width_m.size(); ++i) {
    const std::size_t gate = gate_index(track.course, i);
    if (gate < standing) continue;
    ++standing;
    if (track.leg_width_m[i] <= 0) continue;
    const std::vector<scene::Box> legs = scene::leg_boxes(world->gates[gate], track.leg_width_m[i], world->floor_z_m);
    world->boxes.insert(world->boxes.end(), legs.begin(), legs.end());
  }
}

scene::World nominal_world(const Track& track) {
  scene::World world = bare_world(track);
  furnish(track, &world);
  return world;
}

std::vector<scene::Passage> passages(const Course& course) {
  std::vector<scene::Passage> passages;
  std::vector<Eigen::Vector3d> axes_W;  // of each gate, by its first passage
  for (std::size_t i = 0; i < course.waypoints.size(); ++i) {
    const std::size_t gate = gate_index(course, i);
    const Eigen::Vector3d direction_W = passing_direction(course, i);
    if (gate == axes_W.size()) axes_W.push_back(direction_W);
    passages.push_back({gate, direction_W.dot(axes_W[gate]) > 0});
  }
  return passages;
}

std::vector<scene::Gate> gates_by_waypoint(const scene::World& world, const Course& course) {
  std::vector<scene::Gate> gates;
  for (const scene::Passage& passage : passages(course)) gates.push_back(scene::as_passed(world, passage));
  return gates;
}

Result<Track> load_track(const std::filesystem::path& file) {
  CourseFile spec;
  if (auto status = load_text(file, &spec); !status) return status.failure();
  Track track;
  if (auto status = convert(spec, &track); !status) return in_file(file, status.failure());
  return track;
}

}  // namespace gatefield::config
