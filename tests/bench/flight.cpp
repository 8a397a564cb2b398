#include "tests/bench/flight.h"

#include <cmath>
#include <numbers>

#include "common/geometry/camera.h"
#include "server/kernels/backend.h"
#include "server/planner/course_progress.h"

namespace gatefield::bench {
namespace {

Eigen::Isometry3d gate_pose(const Eigen::Vector3d& center_W, double yaw_rad) {
  Eigen::Isometry3d X_WG = Eigen::Isometry3d::Identity();
  X_WG.translation() = center_W;
  X_WG.linear() = Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  return X_WG;
}

std::vector<float> draw(const CameraModel& camera, const Eigen::Isometry3d& X_WC,
                        const std::vector<Eigen::Isometry3d>& gates, const GateShape& shape) {
  std::vector<float> depth_m;
  for (int v = 0; v < camera.height_px; ++v) {
    for (int u = 0; u < camera.width_px; ++u) {
      const Eigen::Vector3d ray_W = X_WC.linear() * camera.ray_C(u, v);
      double nearest = camera.max_depth_m;
      if (ray_W.z() < 0) nearest = std::min(nearest, -X_WC.translation().z() / ray_W.z());
      for (const Eigen::Isometry3d& X_WG : gates) {
        const Eigen::Vector3d p_G = X_WG.inverse() * X_WC.translation(), ray_G = X_WG.linear().transpose() * ray_W;
        const double t = -p_G.x() / ray_G.x();
        const double r = transverse_distance(shape, p_G + t * ray_G);
        if (t > 0 && t < nearest && r >= shape.inner_half_m && r <= shape.outer_half_m) nearest = t;
      }
      depth_m.push_back(nearest < camera.max_depth_m ? static_cast<float>(nearest) : 0.0f);
    }
  }
  return depth_m;
}

}  // namespace

std::vector<float> image_of_a_gate(const CameraModel& camera) {
  // Camera axes in a gate's frame: forward along the gate's x.
  Eigen::Isometry3d X_WC = Eigen::Isometry3d::Identity();
  X_WC.linear().col(0) = -Eigen::Vector3d::UnitY();
  X_WC.linear().col(1) = -Eigen::Vector3d::UnitZ();
  X_WC.linear().col(2) = Eigen::Vector3d::UnitX();
  X_WC.translation().z() = 1.5;
  return draw(camera, X_WC, {gate_pose({3.0, 0.2, 1.6}, 0.2)}, {});
}

std::vector<RecordedStep> fly(const model::Bundle& bundle, const planner::Profile& profile, double limit_s) {
  constexpr int kGates = 6;
  constexpr double kRadius_m = 6.0;
  Course course;
  std::vector<Eigen::Isometry3d> gates;
  for (int i = 0; i < kGates; ++i) {
    const double turn = 2 * std::numbers::pi * (i + 1) / kGates;
    const Eigen::Vector3d center_W(kRadius_m * std::cos(turn), kRadius_m * std::sin(turn), 1.6);
    const double yaw_rad = turn + std::numbers::pi / 2;
    course.waypoints.push_back({center_W, Eigen::Vector3d(std::cos(yaw_rad), std::sin(yaw_rad), 0)});
    gates.push_back(gate_pose(center_W + Eigen::Vector3d(0.1, -0.1, 0.1), yaw_rad + (i % 2 == 0 ? 0.2 : -0.2)));
  }
  const CameraModel camera = default_camera();
  const QuadrotorModel model;
  auto encoder = perception::DepthEncoder::create(bundle);
  auto planner = planner::Planner::create(profile, model, course.waypoints[0].gate, bundle.manifest().cone_angle_rad, 1);
  if (!encoder || !planner) return {};
  perception::GateMemory memory(bundle, kernels::best_backend().prepare(bundle.decoder()), course);
  planner::CourseProgress progress(course);

  QuadrotorState state;
  state.p_WB = {kRadius_m, 0, 1.5};
  state.q_WB = Eigen::AngleAxisd(std::numbers::pi / 2 + 0.5, Eigen::Vector3d::UnitZ());
  state.thrust_n = state.thrust_command_n = hover_thrust_n(model);
  const int ms_per_step = static_cast<int>(std::lround(1000.0 / profile.control_rate_hz));
  std::vector<RecordedStep> steps;
  planner::Plan plan;
  for (int ms = 0; ms < 1000 * limit_s && !progress.done(); ms += ms_per_step) {
    const std::uint32_t target = progress.target(), next = progress.next();
    if (steps.size() % 2 == 0) {
      const Eigen::Isometry3d X_WC = Eigen::Translation3d(state.p_WB) * state.q_WB * camera.X_BC;
      const std::vector<float> depth_m = draw(camera, X_WC, gates, course.waypoints[0].gate);
      for (const std::uint32_t waypoint : {target, next}) {
        const Eigen::Vector3d expected_C = X_WC.inverse() * memory.expected_center_W(waypoint);
        if (!camera.sees(expected_C, -0.15 * camera.width_px)) continue;
        if (const auto encoding = encoder.value()->encode(depth_m, camera, expected_C))
          memory.observe(waypoint, *encoding, X_WC, Stamp{std::int64_t{ms} * 1'000'000});
      }
    }
    auto snapshot = std::make_shared<perception::MemorySnapshot>();
    memory.snapshot(target, next, snapshot.get());
    const auto belief = [&](std::uint32_t waypoint, const perception::RememberedGate& gate) {
      planner::GateBelief known = progress.nominal(waypoint);
      if (!gate.seen) return known;
      if (profile.waypoint_from_field) known.center_W = gate.center_W;
      known.axis_W = gate.axis_W;
      known.seen = true;
      known.field = &gate.field;
      return known;
    };
    RecordedStep step;
    step.memory = snapshot;
    step.input.start = state;
    step.input.elapsed_s = steps.empty() ? 0.0 : 1e-3 * ms_per_step;
    step.input.step = steps.size();
    step.input.target = belief(target, snapshot->gates[0]);
    step.input.has_next = progress.has_next();
    step.input.next = belief(next, snapshot->gates[1]);
    if (snapshot->gates[0].seen) step.input.field_age_s = 1e-3 * ms - 1e-9 * double(snapshot->gates[0].stamp.count());
    planner.value()->plan(step.input, &plan);
    for (int i = 0; i < ms_per_step; ++i) state = step_reference(model, state, plan.thrust_rate_n_s[0], 1e-3);
    steps.push_back(std::move(step));
    progress.update(state.p_WB, steps.back().input.target);
  }
  return steps;
}

}  // namespace gatefield::bench
