#include "common/config/course.h"

#include <cmath>
#include <numbers>
#include <sstream>

#include "common/config/course.pb.h"
#include "common/config/text_file.h"
#include "common/protocol/validate.h"

namespace gatefield::config {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kLargestCoordinate_m = 10000.0;

Eigen::Vector3d to_vector(const Vector& v) { return {v.x(), v.y(), v.z()}; }

std::string text(const Eigen::Vector3d& v) {
  std::ostringstream out;
  out << "(" << v.x() << ", " << v.y() << ", " << v.z() << ")";
  return out.str();
}

Status check_number(const std::string& field, double value, double low, double high, const std::string& unit) {
  if (value >= low && value <= high) return {};
  std::ostringstream out;
  out << field << " is " << value << ", expected " << low << " to " << high << unit;
  return Error{out.str()};
}

Status check_point(const std::string& field, const Eigen::Vector3d& p) {
  if (p.allFinite() && p.cwiseAbs().maxCoeff() <= kLargestCoordinate_m) return {};
  return Error{field + " is " + text(p) + ", expected finite coordinates within 10 km"};
}

GateShape::Opening opening_of(GateSpec::Opening opening) {
  return opening == GateSpec::ROUND ? GateShape::Opening::kRound : GateShape::Opening::kSquare;
}

Status add_waypoint(const WaypointSpec& spec, const std::string& field, const GateShape& gate, Course* course) {
  Waypoint waypoint;
  waypoint.p_W = to_vector(spec.position());
  if (auto status = check_point(field + ".position", waypoint.p_W); !status) return status;
  if (spec.has_yaw_deg() && spec.has_direction())
    return Error{field + " has both yaw_deg and direction, expected at most one of them"};
  if (spec.has_yaw_deg()) {
    if (auto status = check_number(field + ".yaw_deg", spec.yaw_deg(), -360, 360, " degrees"); !status) return status;
    waypoint.direction_W = {std::cos(spec.yaw_deg() * kDegree), std::sin(spec.yaw_deg() * kDegree), 0};
  } else if (spec.has_direction()) {
    const Eigen::Vector3d direction = to_vector(spec.direction());
    if (!(direction.allFinite() && direction.norm() > 1e-6))
      return Error{field + ".direction is " + text(direction) + ", expected a finite vector that is not zero"};
    waypoint.direction_W = direction.normalized();
  }
  waypoint.gate = gate;
  if (spec.has_opening()) waypoint.gate.opening = opening_of(spec.opening());
  course->waypoints.push_back(waypoint);
  return {};
}

Status add_clutter(const CourseFile& spec, std::vector<scene::Box>* clutter) {
  for (int i = 0; i < spec.box_size(); ++i) {
    const BoxSpec& box = spec.box(i);
    const std::string field = "box[" + std::to_string(i) + "]";
    scene::Box out;
    const Eigen::Vector3d size = to_vector(box.size());
    if (auto status = check_point(field + ".center", to_vector(box.center())); !status) return status;
    if (!(size.allFinite() && size.minCoeff() >= 0.01 && size.maxCoeff() <= 1000))
      return Error{field + ".size is " + text(size) + ", expected edge lengths of 0.01 to 1000 m"};
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
    if (!volume.contains(p_W))
      return Error{field + " is " + text(p_W) + ", expected a place in the flight volume, " + range};
    const double outer_half_m = track.course.waypoints[i].gate.outer_half_m;
    const double lowest_m = p_W.z() - outer_half_m;
    if (track.has_floor && lowest_m < track.floor_z_m - 1e-9)
      return Error{field + " is " + text(p_W) + ", expected z of at least " +
                   std::to_string(track.floor_z_m + outer_half_m) +
                   " m, so that the gate stands on the floor or above"};
  }
  if (!volume.contains(track.start_p_WB))
    return Error{"start.position is " + text(track.start_p_WB) + ", expected a place in the flight volume, " + range};
  if (track.has_floor && track.start_p_WB.z() <= track.floor_z_m)
    return Error{"start.position is " + text(track.start_p_WB) +
                 ", expected a place above the floor at z = " + std::to_string(track.floor_z_m)};
  return {};
}

Status convert(const CourseFile& spec, Track* track) {
  track->title = spec.title();
  if (spec.waypoint_size() < 1 || spec.waypoint_size() > kMaxWaypoints)
    return Error{"waypoint is given " + std::to_string(spec.waypoint_size()) + " times, expected 1 to " +
                 std::to_string(kMaxWaypoints)};
  GateShape gate;
  gate.opening = opening_of(spec.gate().opening());
  gate.inner_half_m = spec.gate().inner_half_m();
  gate.outer_half_m = spec.gate().outer_half_m();
  gate.thickness_m = spec.gate().thickness_m();
  if (auto status = validate(gate); !status) return status;
  for (int i = 0; i < spec.waypoint_size(); ++i)
    if (auto status = add_waypoint(spec.waypoint(i), "waypoint[" + std::to_string(i) + "]", gate, &track->course);
        !status)
      return status;
  if (auto status = check_number("laps", spec.laps(), 1, kMaxLaps, ""); !status) return status;
  track->course.laps = spec.laps();
  track->course.closed = spec.closed();
  if (auto status = check_number("gate.reflectance", spec.gate().reflectance(), 0, 1, ""); !status) return status;
  track->gate_reflectance = static_cast<float>(spec.gate().reflectance());
  for (std::size_t i = 0; i < track->course.waypoints.size(); ++i) {
    auto& waypoint = track->course.waypoints[i];
    if (waypoint.direction_W.isZero()) waypoint.direction_W = passing_direction(track->course, i);
    if (waypoint.direction_W.isZero())
      return Error{"waypoint[" + std::to_string(i) +
                   "] has no neighbours to take its direction from, expected yaw_deg or direction"};
  }
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
    return Error{"flight_volume.max is " + text(high) +
                 ", expected every coordinate at least 0.5 m above flight_volume.min, " + text(low)};
  track->flight_volume = Eigen::AlignedBox3d(low, high);

  track->has_floor = spec.has_floor();
  if (track->has_floor) {
    if (auto status = check_number("floor.z", spec.floor().z(), -kLargestCoordinate_m, kLargestCoordinate_m, " m");
        !status)
      return status;
    if (auto status = check_number("floor.reflectance", spec.floor().reflectance(), 0, 1, ""); !status) return status;
    track->floor_z_m = spec.floor().z();
    track->floor_reflectance = static_cast<float>(spec.floor().reflectance());
  }
  if (auto status = add_clutter(spec, &track->clutter); !status) return status;
  return check_places(*track);
}

}  // namespace

scene::World nominal_world(const Track& track) {
  scene::World world;
  for (std::size_t i = 0; i < track.course.waypoints.size(); ++i)
    world.gates.push_back({gate_pose(track.course.waypoints[i].p_W, passing_direction(track.course, i)),
                           track.course.waypoints[i].gate, track.gate_reflectance});
  world.boxes = track.clutter;
  world.has_floor = track.has_floor;
  world.floor_z_m = track.floor_z_m;
  world.floor_reflectance = track.floor_reflectance;
  return world;
}

Result<Track> load_track(const std::filesystem::path& file) {
  CourseFile spec;
  if (auto status = load_text(file, &spec); !status) return status.failure();
  Track track;
  if (auto status = convert(spec, &track); !status) return in_file(file, status.failure());
  return track;
}

}  // namespace gatefield::config
