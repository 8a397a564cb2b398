#include "tests/bench/flight.h"

#include <cmath>
#include <numbers>

#include "common/geometry/camera.h"
#include "server/gates/course_progress.h"
#include "server/gates/known_gates.h"
#include "server/kernels/backend.h"
#include "server/perception/learned/learned_sensor.h"
#include "server/perception/sight.h"
#include "tests/support/analytic_field.h"
#include "tests/support/drawn_gates.h"

namespace gatefield::bench {
namespace {

constexpr double kRadius_m = 6.0;

}  // namespace

std::vector<float> image_of_a_gate(const CameraModel& camera) {
  // Camera axes in a gate's frame: forward along the gate's x.
  Eigen::Isometry3d X_WC = Eigen::Isometry3d::Identity();
  X_WC.linear().col(0) = -Eigen::Vector3d::UnitY();
  X_WC.linear().col(1) = -Eigen::Vector3d::UnitZ();
  X_WC.linear().col(2) = Eigen::Vector3d::UnitX();
  X_WC.translation().z() = 1.5;
  return test::draw_gates(camera, X_WC, {test::upright_gate({3.0, 0.2, 1.6}, 0.2)}, {});
}

Course circle_course() {
  constexpr int kGates = 6;
  Course course;
  course.floor_z_m = 0.0;
  for (int i = 0; i < kGates; ++i) {
    const double turn = 2 * std::numbers::pi * (i + 1) / kGates;
    const double yaw_rad = turn + std::numbers::pi / 2;
    course.waypoints.push_back(
        {{kRadius_m * std::cos(turn), kRadius_m * std::sin(turn), 1.6}, {std::cos(yaw_rad), std::sin(yaw_rad), 0}, {}});
  }
  return course;
}

std::vector<RecordedStep> fly(const model::Bundle& bundle, const planner::Profile& profile, double limit_s) {
  const Course course = circle_course();
  std::vector<Eigen::Isometry3d> gates;
  for (const Waypoint& waypoint : course.waypoints) {
    const double yaw_rad = std::atan2(waypoint.direction_W.y(), waypoint.direction_W.x());
    gates.push_back(test::upright_gate(waypoint.p_W + Eigen::Vector3d(0.1, -0.1, 0.1),
                                       yaw_rad + (gates.size() % 2 == 0 ? 0.2 : -0.2)));
  }
  const CameraModel camera = default_camera();
  const QuadrotorModel model;
  auto encoders = perception::EncoderPool::create(bundle, 1);
  auto planner = planner::Planner::create(profile, model, course, bundle.manifest().cone_angle_rad, 1);
  if (!encoders || !planner) return {};
  perception::LearnedSensor sensor(&bundle, kernels::best_backend().prepare(bundle.decoder()), encoders.value().get());
  gates::GateRecords records(course);
  gates::CourseProgress progress(course);
  gates::KnownGates known(&progress.passages());

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
      const std::vector<float> depth_m = test::draw_gates(camera, X_WC, gates, course.waypoints[0].gate);
      for (const std::uint32_t waypoint : {target, next}) {
        const gates::Expectation gate = records.expectation(waypoint);
        if (!camera.sees(X_WC.inverse() * gate.center_W, -0.15 * camera.width_px)) continue;
        if (const auto seen = sensor.look({depth_m, camera, X_WC}, gate, perception::Where::kExpected))
          perception::remember(*seen, waypoint, Stamp{std::int64_t{ms} * 1'000'000}, &sensor, &records);
      }
    }
    const auto snapshot = std::make_shared<gates::Snapshot>();
    records.snapshot(target, next, snapshot.get());
    known.take(snapshot.get());
    const auto belief = [&](std::uint32_t waypoint) {
      gates::GateBelief gate = known.belief(waypoint);
      if (!profile.waypoint_from_field) gate.center_W = progress.nominal(waypoint).center_W;
      return gate;
    };
    RecordedStep step;
    step.snapshot = snapshot;
    step.input.start = state;
    step.input.elapsed_s = steps.empty() ? 0.0 : 1e-3 * ms_per_step;
    step.input.step = steps.size();
    step.input.target = belief(target);
    step.input.has_next = progress.has_next();
    step.input.next = belief(next);
    step.input.field_age_s = std::max(0.0, known.age_s(target, Stamp{std::int64_t{ms} * 1'000'000}));
    planner.value()->plan(step.input, &plan);
    for (int i = 0; i < ms_per_step; ++i) state = step_reference(model, state, plan.thrust_rate_n_s[0], 1e-3);
    steps.push_back(std::move(step));
    progress.update(state.p_WB, steps.back().input.target);
  }
  return steps;
}

}  // namespace gatefield::bench
