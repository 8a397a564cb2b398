#include "server/service/trial.h"

#include <cstring>
#include <memory>
#include <utility>

#include "common/base/logging.h"
#include "common/geometry/gate.h"
#include "server/pilot/pilot.h"
#include "server/service/processor_time.h"

namespace gatefield::service {
namespace {

using namespace std::chrono_literals;

constexpr std::uint64_t kSession = 1;
constexpr int kSteps = 3;         // of each profile; the first one warms up
constexpr int kStatesBefore = 2;  // the frame: it needs a pose
constexpr Stamp kState = 10ms;

protocol::SessionRequest trial_request(const planner::Profile& profile) {
  protocol::SessionRequest request;
  request.vehicle = "trial";
  request.request = 1;
  request.profile = profile.name;
  request.camera = default_camera();
  Waypoint gate;
  gate.p_W = {3.0, 0.0, 1.5};
  gate.direction_W = Eigen::Vector3d::UnitX();
  request.course.waypoints = {gate};
  return request;
}

/// The gate as the camera of a vehicle at (0, 0, 1.5) sees it, level and along x, before nothing.
protocol::DepthFrame drawn_frame(const protocol::SessionRequest& request) {
  const CameraModel& camera = request.camera;
  const Waypoint& gate = request.course.waypoints.front();
  const Eigen::Isometry3d X_BC = camera.X_BC;
  const double ahead_m = gate.p_W.x() - X_BC.translation().x();
  protocol::DepthFrame frame;
  frame.vehicle = request.vehicle;
  frame.session = kSession;
  frame.sequence = 1;
  frame.width_px = static_cast<std::uint32_t>(camera.width_px);
  frame.height_px = static_cast<std::uint32_t>(camera.height_px);
  frame.encoding = protocol::DepthEncoding::kMetres32;
  std::vector<float> depth_m;
  for (int v = 0; v < camera.height_px; ++v)
    for (int u = 0; u < camera.width_px; ++u) {
      const Eigen::Vector3d ray_B = X_BC.linear() * camera.ray_C(u, v);
      const double depth = ahead_m / ray_B.x();
      const double r = transverse_distance(gate.gate, X_BC.translation() + depth * ray_B);
      const bool hit = ray_B.x() > 0 && r >= gate.gate.inner_half_m && r <= gate.gate.outer_half_m;
      depth_m.push_back(hit && depth < camera.max_depth_m ? static_cast<float>(depth) : 0.0f);
    }
  frame.pixels.resize(depth_m.size() * sizeof(float));
  std::memcpy(frame.pixels.data(), depth_m.data(), frame.pixels.size());
  return frame;
}

Result<std::unique_ptr<pilot::Pilot>> trial_pilot(const planner::Profile& profile, const Factories& factories,
                                                  Stamp now) {
  pilot::PilotParts parts;
  parts.request = trial_request(profile);
  auto planner = factories.planner(profile, parts.request);
  if (!planner) return planner.failure();
  auto sensor = factories.sensor(parts.request);
  if (!sensor) return sensor.failure();
  parts.session = kSession;
  parts.planner = std::move(planner).value();
  parts.sensor = std::move(sensor).value();
  parts.now = now;
  return std::make_unique<pilot::Pilot>(std::move(parts));
}

void try_profile(const planner::Profile& profile, const Factories& factories, Costs* costs) {
  Stamp now = 1s;  // of both clocks
  const auto made = trial_pilot(profile, factories, now);
  if (!made) return log::debug("profile " + profile.name + " was not tried: " + made.error());
  pilot::Pilot& pilot = **made;
  protocol::VehicleState state;
  state.vehicle = pilot.vehicle();
  state.session = kSession;
  state.state.p_WB = {0.0, 0.0, 1.5};
  state.state.thrust_n = state.state.thrust_command_n = hover_thrust_n(pilot.request().quadrotor);
  std::chrono::nanoseconds stepping{0};
  for (int i = 0; i < kStatesBefore + kSteps; ++i) {
    now += kState;
    state.stamp = now;
    ++state.sequence;
    pilot.intake().take_state(state, now);
    if (i < kStatesBefore) continue;
    if (i == kStatesBefore) {
      protocol::DepthFrame frame = drawn_frame(pilot.request());
      frame.stamp = now - kState;
      pilot.intake().take_depth(frame, now);
      const auto before = processor_time_of_thread();
      if (pilot.looking().look()) costs->learn_look(processor_time_of_thread() - before);
    }
    const auto before = processor_time_of_thread();
    const bool planned = pilot.stepping().step(now).command != nullptr;
    const auto took = processor_time_of_thread() - before;
    if (planned) pilot.stepping().solved(took);
    if (i > kStatesBefore) stepping += took;
  }
  costs->learn_step(profile, stepping / (kSteps - 1));
}

}  // namespace

Costs costs_by_trial(const Profiles& profiles, const Factories& factories) {
  planner::Planner::prepare_thread();
  Costs costs;
  for (const auto& [name, profile] : profiles) try_profile(profile, factories, &costs);
  return costs;
}

}  // namespace gatefield::service
