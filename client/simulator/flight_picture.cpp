#include "client/simulator/flight_picture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "client/simulator/canvas.h"
#include "client/simulator/view.h"

namespace gatefield::simulator {
namespace {

/// What the colours mean: from the speed below which the vehicle hardly ever was up to the top, so that differences
/// show.
struct SpeedRange {
  double axis_top_m_s = 1.0;
  double low_m_s = 0.0;
  double high_m_s = 1.0;

  explicit SpeedRange(const Report& report) : SpeedRange(speeds_of(report), report.top_speed_m_s) {}

  SpeedRange(std::vector<double> speeds, double top_m_s) {
    std::sort(speeds.begin(), speeds.end());
    high_m_s = std::max(top_m_s, 1.0);
    const double slow_m_s = speeds.empty() ? 0.0 : speeds[speeds.size() / 12];
    low_m_s = std::min(slow_m_s, 0.75 * high_m_s);
    const double step = tick_step(high_m_s, 6), fine = tick_step(high_m_s - low_m_s, 6);
    axis_top_m_s = step * std::ceil(high_m_s / step - 1e-9);
    low_m_s = fine * std::floor(low_m_s / fine + 1e-9);
    high_m_s = fine * std::ceil(high_m_s / fine - 1e-9);
  }
  cv::Scalar color(double speed_m_s) const { return ramp_color((speed_m_s - low_m_s) / (high_m_s - low_m_s)); }

 private:
  static std::vector<double> speeds_of(const Report& report) {
    std::vector<double> speeds;
    for (const auto& sample : report.samples)
      if (sample.state.v_WB.allFinite()) speeds.push_back(sample.state.v_WB.norm());
    return speeds;
  }
};

void extend(Eigen::AlignedBox3d* box, const scene::World& world) {
  for (const auto& gate : world.gates)
    for (const auto& piece : scene::frame_boxes(gate)) {
      box->extend(piece.X_WO.translation() - Eigen::Vector3d::Constant(piece.half_m.maxCoeff()));
      box->extend(piece.X_WO.translation() + Eigen::Vector3d::Constant(piece.half_m.maxCoeff()));
    }
}

std::vector<Eigen::Vector3d> path_of(const Report& report) {
  std::vector<Eigen::Vector3d> path;
  for (const auto& sample : report.samples) path.push_back(sample.state.p_WB);
  return path;
}

/// Everything that must be seen, with a margin, but no more of the flight volume than needed.
Eigen::AlignedBox3d shown_volume(const config::Scenario& scenario, const scene::World& world,
                                 const std::vector<Eigen::Vector3d>& path) {
  Eigen::AlignedBox3d box;
  extend(&box, world);
  for (const auto& waypoint : scenario.track.course.waypoints) box.extend(waypoint.p_W);
  for (const auto& p_W : path)
    if (p_W.allFinite()) box.extend(inside(scenario.track, p_W));
  box.extend(scenario.track.start_p_WB);
  box.min().array() -= 0.8;
  box.max().array() += 0.8;
  if (world.has_floor) box.min().z() = world.floor_z_m;
  return box;
}

void draw_path(Canvas* canvas, const View& view, const config::Scenario& scenario, const Report& report,
               const SpeedRange& speeds) {
  for (std::size_t i = 1; i < report.samples.size(); ++i) {
    const auto& from = report.samples[i - 1].state;
    const auto& to = report.samples[i].state;
    if (!from.p_WB.allFinite() || !to.p_WB.allFinite()) continue;
    canvas->line(view(inside(scenario.track, from.p_WB)), view(inside(scenario.track, to.p_WB)),
                 speeds.color(to.v_WB.norm()), 2.5);
  }
  draw_start(canvas, view, scenario.track);
  if (report.samples.empty() || report.outcome == Outcome::kFinished) return;
  const Eigen::Vector2d end = view(inside(scenario.track, report.samples.back().state.p_WB));
  canvas->line(end - Eigen::Vector2d(9, 9), end + Eigen::Vector2d(9, 9), kBad, 4);
  canvas->line(end - Eigen::Vector2d(9, -9), end + Eigen::Vector2d(9, -9), kBad, 4);
}

/// The gates of one flight among many: the fainter, the more there are.
void draw_gates(Canvas* canvas, const View& view, const scene::World& world, double opacity) {
  for (const auto& gate : world.gates) {
    fill_opening(canvas, view, gate, 0.3 * opacity);
    for (const auto& piece : scene::frame_boxes(gate)) view.draw_box(piece, kFrame, opacity);
  }
}

void draw_flight(Canvas* canvas, const View& view, const config::Track& track, const FlownPath& flight,
                 const SpeedRange& speeds) {
  for (std::size_t i = 1; i < flight.points.size(); ++i) {
    const auto &from = flight.points[i - 1], &to = flight.points[i];
    if (!from.p_W.allFinite() || !to.p_W.allFinite()) continue;
    canvas->line(view(inside(track, from.p_W)), view(inside(track, to.p_W)), speeds.color(to.speed_m_s), 1.3);
  }
  if (flight.won || flight.points.empty() || !flight.points.back().p_W.allFinite()) return;
  const Eigen::Vector2d end = view(inside(track, flight.points.back().p_W));
  canvas->line(end - Eigen::Vector2d(7, 7), end + Eigen::Vector2d(7, 7), kBad, 3);
  canvas->line(end - Eigen::Vector2d(7, -7), end + Eigen::Vector2d(7, -7), kBad, 3);
}

void draw_speed(Canvas* canvas, const Eigen::Vector2d& top_left, const Eigen::Vector2d& size, const Report& report,
                const SpeedRange& speeds) {
  const Eigen::Vector2d bottom_right = top_left + size;
  const double end_s = std::max(report.race_time_s, 1e-3);
  const auto at = [&](double t_s, double speed_m_s) {
    return Eigen::Vector2d(top_left.x() + size.x() * t_s / end_s,
                           bottom_right.y() - size.y() * std::min(speed_m_s / speeds.axis_top_m_s, 1.0));
  };
  const double time_step = tick_step(end_s, 12), speed_step = tick_step(speeds.axis_top_m_s, 6);
  for (double t_s = 0; t_s <= end_s + 1e-9; t_s += time_step) {
    canvas->line(at(t_s, 0), at(t_s, speeds.axis_top_m_s), kFaint, 1);
    canvas->text(tick_label(t_s, time_step), at(t_s, 0) + Eigen::Vector2d(0, 20), 10, kInk, Align::kCenter);
  }
  for (double speed = 0; speed <= speeds.axis_top_m_s + 1e-9; speed += speed_step) {
    canvas->line(at(0, speed), at(end_s, speed), kFaint, 1);
    canvas->text(tick_label(speed, speed_step), at(0, speed) + Eigen::Vector2d(-8, 5), 10, kInk, Align::kRight);
  }
  for (const Pass& pass : report.passes) {
    const Eigen::Vector2d top = at(seconds(pass.time), speeds.axis_top_m_s);
    canvas->dashed_line(top, at(seconds(pass.time), 0), kOpening, 1.5, 5);
    if (report.passes.size() <= 24)
      canvas->text(std::to_string(pass.waypoint + 1), top + Eigen::Vector2d(0, -6), 10, kOpening, Align::kCenter);
  }
  for (std::size_t i = 1; i < report.samples.size(); ++i) {
    const double from = report.samples[i - 1].state.v_WB.norm(), to = report.samples[i].state.v_WB.norm();
    if (!std::isfinite(from) || !std::isfinite(to)) continue;
    canvas->line(at(report.samples[i - 1].t_s, from), at(report.samples[i].t_s, to), speeds.color(to), 2.5);
  }
  canvas->rectangle(top_left, bottom_right, kAxis, 1);
  canvas->text("Speed, gates passed", top_left + Eigen::Vector2d(0, -26), 13, kInk, Align::kLeft, true);
  canvas->text("time [s]", {top_left.x() + 0.5 * size.x(), bottom_right.y() + 44}, 11, kInk, Align::kCenter);
  canvas->vertical_text("speed [m/s]", {top_left.x() - 48, top_left.y() + 0.5 * size.y()}, 11, kInk);
}

void draw_legend(Canvas* canvas, Eigen::Vector2d at) {
  const auto entry = [&](const std::string& what) {
    canvas->text(what, at + Eigen::Vector2d(18, 5), 11, kInk);
    at.x() += 18 + Canvas::text_width(what, 11) + 44;
  };
  canvas->rectangle(at + Eigen::Vector2d(-14, -6), at + Eigen::Vector2d(-6, 6), kFrame, -1);
  canvas->line(at + Eigen::Vector2d(-5, 0), at + Eigen::Vector2d(5, 0), kOpening, 2.5);
  canvas->rectangle(at + Eigen::Vector2d(6, -6), at + Eigen::Vector2d(12, 6), kFrame, -1);
  entry("true gate and its opening");
  canvas->circle(at, 6, kNominal, 2);
  canvas->line(at - Eigen::Vector2d(3, 0), at + Eigen::Vector2d(3, 0), kNominal, 1.5);
  canvas->line(at - Eigen::Vector2d(0, 3), at + Eigen::Vector2d(0, 3), kNominal, 1.5);
  entry("nominal waypoint");
  canvas->circle(at, 6, kInk, 2.5);
  entry("start");
}

}  // namespace

Status write_flight_picture(const std::filesystem::path& file, const config::Scenario& scenario, const Report& report,
                            const std::string& subtitle) {
  const scene::World world = config::perturbed_world(scenario.track, scenario.perturbation, scenario.seed);
  const Eigen::AlignedBox3d shown = shown_volume(scenario, world, path_of(report));
  const SpeedRange speeds(report);

  Canvas canvas(1800, 1000);
  const std::string title = (scenario.title.empty() ? "" : scenario.title + " - ") + report.sentence;
  draw_heading(&canvas, title, subtitle, 1800, report.outcome == Outcome::kFinished ? kGood : kBad);

  const Eigen::AlignedBox2d plan(Eigen::Vector2d(shown.min().head<2>()), Eigen::Vector2d(shown.max().head<2>()));
  const View top(&canvas, {110, 130}, {780, 780}, 0, 1, plan);
  top.draw_axes("Top view", "x [m]", "y [m]");
  draw_world(&canvas, top, world);
  draw_path(&canvas, top, scenario, report, speeds);
  draw_nominal(&canvas, top, scenario.track);
  draw_numbers(&canvas, top, world, scenario.track.course);

  const Eigen::AlignedBox2d elevation(Eigen::Vector2d(shown.min().x(), shown.min().z()),
                                      Eigen::Vector2d(shown.max().x(), shown.max().z()));
  const View side(&canvas, {990, 130}, {670, 380}, 0, 2, elevation);
  side.draw_axes("Side view, along y", "x [m]", "z [m]");
  draw_world(&canvas, side, world);
  draw_path(&canvas, side, scenario, report, speeds);
  draw_nominal(&canvas, side, scenario.track);

  const double speed_top = side.bottom_right().y() + 130;
  draw_speed(&canvas, {990, speed_top}, {670, 910 - speed_top}, report, speeds);
  draw_color_bar(&canvas, {1712, 160}, 22, 750, speeds.low_m_s, speeds.high_m_s, "speed [m/s]");
  draw_legend(&canvas, {100, 978});

  return canvas.save(file);
}

Status write_flights_picture(const std::filesystem::path& file, const config::Scenario& scenario,
                             const std::vector<FlownPath>& flights, const std::string& title,
                             const std::string& subtitle) {
  std::vector<scene::World> worlds;
  std::vector<Eigen::Vector3d> path;
  std::vector<double> speeds_m_s;
  double top_m_s = 0.0;
  for (const FlownPath& flight : flights) {
    worlds.push_back(config::perturbed_world(scenario.track, scenario.perturbation, flight.seed));
    for (const auto& point : flight.points) {
      path.push_back(point.p_W);
      if (!std::isfinite(point.speed_m_s)) continue;
      speeds_m_s.push_back(point.speed_m_s);
      top_m_s = std::max(top_m_s, point.speed_m_s);
    }
  }
  const scene::World nominal = config::nominal_world(scenario.track);
  Eigen::AlignedBox3d shown = shown_volume(scenario, nominal, path);
  for (const auto& world : worlds) extend(&shown, world);
  if (nominal.has_floor) shown.min().z() = nominal.floor_z_m;
  const SpeedRange speeds(std::move(speeds_m_s), top_m_s);

  Canvas canvas(1800, 1000);
  draw_heading(&canvas, title, subtitle, 1800);

  const double opacity = std::max(0.06, 0.6 / std::sqrt(static_cast<double>(std::max<std::size_t>(flights.size(), 1))));
  const auto draw = [&](const View& view) {
    for (const auto& box : nominal.boxes) view.draw_box(box, kClutter, 0.45);
    for (const auto& world : worlds) draw_gates(&canvas, view, world, opacity);
    for (const FlownPath& flight : flights) draw_flight(&canvas, view, scenario.track, flight, speeds);
    draw_start(&canvas, view, scenario.track);
    draw_nominal(&canvas, view, scenario.track);
  };
  const View top(&canvas, {110, 130}, {780, 780}, 0, 1,
                 {Eigen::Vector2d(shown.min().head<2>()), Eigen::Vector2d(shown.max().head<2>())});
  top.draw_axes("Top view", "x [m]", "y [m]");
  draw(top);
  draw_numbers(&canvas, top, nominal, scenario.track.course);
  const View side(
      &canvas, {990, 130}, {670, 700}, 0, 2,
      {Eigen::Vector2d(shown.min().x(), shown.min().z()), Eigen::Vector2d(shown.max().x(), shown.max().z())});
  side.draw_axes("Side view, along y", "x [m]", "z [m]");
  draw(side);
  draw_color_bar(&canvas, {1712, 160}, 22, 750, speeds.low_m_s, speeds.high_m_s, "speed [m/s]");
  draw_legend(&canvas, {100, 978});

  return canvas.save(file);
}

}  // namespace gatefield::simulator
