#include "client/simulator/belief_picture.h"

#include <algorithm>
#include <cmath>

#include "client/simulator/depth_sensor.h"
#include "client/simulator/simulation.h"
#include "client/simulator/view.h"
#include "common/base/text.h"

namespace gatefield::simulator {
namespace {

constexpr double kShown_s = 1.0;                      ///< before the end
constexpr double kAround_m = 3.0;                     ///< an end picture shows this far to each side
constexpr double kLowest_m = -1.0, kHighest_m = 1.0;  ///< field values between which colours change

/// Dark red over pale to dark green.
cv::Scalar field_color(double field_m) {
  const double share = std::clamp(field_m / (field_m < 0 ? kLowest_m : kHighest_m), 0.0, 1.0);
  const cv::Scalar pale = field_m <= 0 ? cv::Scalar(150, 150, 245) : cv::Scalar(150, 225, 150);
  const cv::Scalar deep = field_m <= 0 ? cv::Scalar(30, 20, 190) : cv::Scalar(40, 120, 20);
  return pale * (1.0 - share) + deep * share;
}

void draw_field_bar(Canvas* canvas, const Eigen::Vector2d& top_left, double width, double height) {
  constexpr int kRows = 64;
  for (int row = 0; row < kRows; ++row) {
    const double value = kHighest_m - (row + 0.5) / kRows * (kHighest_m - kLowest_m);
    canvas->rectangle(top_left + Eigen::Vector2d(0, height * row / kRows),
                      top_left + Eigen::Vector2d(width, height * (row + 1) / kRows), field_color(value), -1);
  }
  canvas->rectangle(top_left, top_left + Eigen::Vector2d(width, height), kInk, 1);
  for (const double value : {-1.0, -0.5, 0.0, 0.5, 1.0})
    canvas->text(tick_label(value, 0.5),
                 top_left + Eigen::Vector2d(width + 9, height * (kHighest_m - value) / (kHighest_m - kLowest_m) + 5),
                 10, kInk);
  canvas->text("SDF [m]", top_left + Eigen::Vector2d(0.5 * width + 6, -14), 11, kInk, Align::kCenter);
}

double race_time_s(const trace::Step& step) { return seconds(step.stamp - kLockstepEpoch); }

void draw_rollout(Canvas* canvas, const View& view, const Eigen::Vector3d& from_W, const trace::Rollout& rollout,
                  double width) {
  Eigen::Vector3d before_W = from_W;
  for (std::size_t k = 0; k < rollout.p_W.size(); ++k) {
    const Eigen::Vector3d& p_W = rollout.p_W[k];
    const cv::Scalar color = std::isfinite(rollout.field_m[k]) ? field_color(rollout.field_m[k]) : kClutter;
    if (view.shows(before_W) && view.shows(p_W)) canvas->line(view(before_W), view(p_W), color, width);
    before_W = p_W;
  }
}

void draw_path(Canvas* canvas, const View& view, const Report& report, double from_s, double to_s, double width) {
  for (std::size_t i = 1; i < report.samples.size(); ++i) {
    const auto &from = report.samples[i - 1], &to = report.samples[i];
    if (from.t_s < from_s || to.t_s > to_s || !view.shows(from.state.p_WB) || !view.shows(to.state.p_WB)) continue;
    canvas->line(view(from.state.p_WB), view(to.state.p_WB), kInk, width);
  }
}

/// The opening where it is believed to be, upright as far as its axis allows, and its axis.
void draw_belief(Canvas* canvas, const View& view, const GateShape& shape, const trace::Step& step, double age) {
  const Eigen::Isometry3d X_WG = gate_pose(step.center_W, step.axis_W);
  const cv::Scalar color = step.seen ? cv::Scalar(230, 160, 60) : kNominal;
  const cv::Scalar faded = color + (cv::Scalar(255, 255, 255) - color) * (0.75 * age);
  const auto at = [&](double x, double y, double z) { return Eigen::Vector3d(X_WG * Eigen::Vector3d(x, y, z)); };
  const std::vector<Eigen::Vector3d> edge = opening_edge_W(shape, X_WG);
  for (std::size_t i = 0; i < edge.size(); ++i) {
    const Eigen::Vector3d &from = edge[i], &to = edge[(i + 1) % edge.size()];
    if (view.shows(from) && view.shows(to)) canvas->line(view(from), view(to), faded, 1.8);
  }
  if (view.shows(at(0, 0, 0)) && view.shows(at(0.5, 0, 0)))
    canvas->line(view(at(0, 0, 0)), view(at(0.5, 0, 0)), faded, 1.2);
}

Eigen::AlignedBox2d around(const Eigen::Vector3d& p_W, int across, int up, double half_m) {
  const Eigen::Vector2d middle(p_W[across], p_W[up]), half = Eigen::Vector2d::Constant(half_m);
  return {Eigen::Vector2d(middle - half), Eigen::Vector2d(middle + half)};
}

/// Everything of a flight and its world, with a margin.
Eigen::AlignedBox3d whole(const scene::World& world, const Report& report, const config::Track& track) {
  Eigen::AlignedBox3d box;
  for (const auto& gate : world.gates) {
    box.extend(gate.X_WG.translation() - Eigen::Vector3d::Constant(gate.shape.outer_half_m));
    box.extend(gate.X_WG.translation() + Eigen::Vector3d::Constant(gate.shape.outer_half_m));
  }
  for (const auto& sample : report.samples)
    if (sample.state.p_WB.allFinite()) box.extend(inside(track, sample.state.p_WB));
  box.min().array() -= 1.2;
  box.max().array() += 1.2;
  if (world.has_floor) box.min().z() = world.floor_z_m;
  return box;
}

}  // namespace

Status write_end_picture(const std::filesystem::path& file, const config::Scenario& scenario, const Report& report,
                         const std::vector<trace::Step>& trace, int waypoint, const std::string& title,
                         const std::string& subtitle) {
  const scene::World world = config::perturbed_world(scenario.track, scenario.perturbation, scenario.seed);
  Eigen::Vector3d middle_W = inside(scenario.track, report.end_state.p_WB);
  int across = 0;
  const std::vector<scene::Gate> gates = config::gates_by_waypoint(world, scenario.track.course);
  if (waypoint >= 0 && waypoint < static_cast<int>(gates.size())) {
    const Eigen::Isometry3d& X_WG = gates[static_cast<std::size_t>(waypoint)].X_WG;
    if ((X_WG.translation() - middle_W).norm() < 2 * kAround_m) middle_W = 0.5 * (middle_W + X_WG.translation());
    across = std::abs(X_WG.linear()(0, 0)) >= std::abs(X_WG.linear()(1, 0)) ? 0 : 1;
  }
  const double end_s = report.race_time_s;

  Canvas canvas(1500, 860);
  draw_heading(&canvas, title, subtitle, 1500);
  const auto draw = [&](const View& view) {
    draw_world(&canvas, view, world);
    for (const trace::Step& step : trace) {
      const double age = (end_s - race_time_s(step)) / kShown_s;
      if (static_cast<int>(step.waypoint) == waypoint && !step.hold && age >= 0 && age <= 1)
        draw_belief(&canvas, view, scenario.track.course.waypoints[step.waypoint].gate, step, age);
    }
    draw_nominal(&canvas, view, scenario.track);
    draw_path(&canvas, view, report, end_s - kShown_s, end_s, 3.0);
    const Eigen::Vector3d end_W = inside(scenario.track, report.end_state.p_WB);
    if (report.outcome == Outcome::kFinished || !view.shows(end_W)) return;
    canvas.line(view(end_W) - Eigen::Vector2d(9, 9), view(end_W) + Eigen::Vector2d(9, 9), kBad, 4);
    canvas.line(view(end_W) - Eigen::Vector2d(9, -9), view(end_W) + Eigen::Vector2d(9, -9), kBad, 4);
  };
  const View top(&canvas, {110, 140}, {600, 600}, 0, 1, around(middle_W, 0, 1, kAround_m));
  top.draw_axes("From above, the last second", "x [m]", "y [m]");
  draw(top);
  const View side(&canvas, {830, 140}, {600, 600}, across, 2, around(middle_W, across, 2, kAround_m));
  side.draw_axes("From the side", across == 0 ? "x [m]" : "y [m]", "z [m]");
  draw(side);
  canvas.text(
      "dark and green: the true gate; blue: its opening as believed, darker with time; orange: the nominal "
      "waypoint, and what is believed before anything is seen",
      {110, 830}, 11, kInk);
  return canvas.save(file);
}

Status write_rollouts_picture(const std::filesystem::path& file, const config::Scenario& scenario, const Report& report,
                              const std::vector<trace::Step>& trace, const std::string& title,
                              const std::string& subtitle) {
  const scene::World world = config::perturbed_world(scenario.track, scenario.perturbation, scenario.seed);
  const Eigen::AlignedBox3d box = whole(world, report, scenario.track);
  Canvas canvas(1800, 1000);
  draw_heading(&canvas, title, subtitle, 1800);
  const auto draw = [&](const View& view) {
    for (const trace::Step& step : trace)
      for (const trace::Rollout& rollout : step.rollouts) draw_rollout(&canvas, view, step.p_W, rollout, 0.6);
    draw_world(&canvas, view, world);
    draw_path(&canvas, view, report, 0.0, report.race_time_s, 1.6);
    draw_start(&canvas, view, scenario.track);
    draw_nominal(&canvas, view, scenario.track);
  };
  const View top(&canvas, {110, 130}, {780, 780}, 0, 1,
                 {Eigen::Vector2d(box.min().head<2>()), Eigen::Vector2d(box.max().head<2>())});
  top.draw_axes("From above", "x [m]", "y [m]");
  draw(top);
  draw_numbers(&canvas, top, world, scenario.track.course);
  const View side(&canvas, {990, 130}, {670, 700}, 0, 2,
                  {Eigen::Vector2d(box.min().x(), box.min().z()), Eigen::Vector2d(box.max().x(), box.max().z())});
  side.draw_axes("From the side, along y", "x [m]", "z [m]");
  draw(side);
  draw_field_bar(&canvas, {1725, 170}, 22, 700);
  return canvas.save(file);
}

Status write_approach_picture(const std::filesystem::path& file, const config::Scenario& scenario, const Report& report,
                              const std::vector<trace::Step>& trace, const std::string& title,
                              const std::string& subtitle) {
  const scene::World world = config::perturbed_world(scenario.track, scenario.perturbation, scenario.seed);
  const double until_s = report.passes.empty() ? report.race_time_s : seconds(report.passes.front().time);
  std::vector<const trace::Step*> steps;  // with rollouts, on the way to the first gate
  for (const trace::Step& step : trace)
    if (!step.rollouts.empty() && race_time_s(step) <= until_s) steps.push_back(&step);
  constexpr std::size_t kMoments = 4;
  const Eigen::Vector3d gate_W = world.gates.front().X_WG.translation();
  Canvas canvas(1800, 860);
  draw_heading(&canvas, title, subtitle, 1800);
  DepthSensor sensor(world, scenario);
  for (std::size_t moment = 0; moment < std::min(kMoments, steps.size()); ++moment) {
    // As far apart as they are on the way.
    const double share = static_cast<double>(moment) / kMoments;
    const double distance_m = (steps.front()->p_W - gate_W).norm() * (1.0 - share);
    const trace::Step& step =
        **std::min_element(steps.begin(), steps.end(), [&](const trace::Step* a, const trace::Step* b) {
          return std::abs((a->p_W - gate_W).norm() - distance_m) < std::abs((b->p_W - gate_W).norm() - distance_m);
        });
    const double left = 90 + 410.0 * static_cast<double>(moment);
    const auto sample = std::find_if(report.samples.begin(), report.samples.end(),
                                     [&](const Sample& s) { return s.t_s >= race_time_s(step) - 1e-6; });
    if (sample != report.samples.end()) {
      Eigen::Isometry3d X_WB = Eigen::Isometry3d::Identity();
      X_WB.linear() = sample->state.q_WB.toRotationMatrix();
      X_WB.translation() = sample->state.p_WB;
      canvas.image(depth_colors(sensor.capture(X_WB), scenario.vehicle.camera.max_depth_m), {left, 130}, 350, 197);
    }
    const Eigen::Vector3d middle_W = 0.5 * (steps.front()->p_W + gate_W);
    const double half_m = 0.5 * (steps.front()->p_W - gate_W).norm() + 1.5;
    const View view(&canvas, {left, 400}, {350, 350}, 0, 1, around(middle_W, 0, 1, half_m));
    const std::string caption = fixed(race_time_s(step), 2) + " s, " + fixed((step.p_W - gate_W).norm(), 1) +
                                " m away" + (step.seen ? "" : ", not seen yet");
    view.draw_axes(caption, "x [m]", moment == 0 ? "y [m]" : "");
    for (const trace::Rollout& rollout : step.rollouts) draw_rollout(&canvas, view, step.p_W, rollout, 1.0);
    draw_world(&canvas, view, world);
    draw_belief(&canvas, view, scenario.track.course.waypoints[step.waypoint].gate, step, 0.0);
    draw_path(&canvas, view, report, 0.0, race_time_s(step), 1.6);
    draw_nominal(&canvas, view, scenario.track);
  }
  draw_field_bar(&canvas, {1735, 440}, 18, 310);
  canvas.text(
      "depth frames: near is blue, far is red, black is no return; below, from above: rollouts by their field "
      "value, the true gate dark, the believed opening blue",
      {90, 835}, 11, kInk);
  return canvas.save(file);
}

}  // namespace gatefield::simulator
