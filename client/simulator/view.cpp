#include "client/simulator/view.h"

#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>

namespace gatefield::simulator {

void View::draw_axes(const std::string& title, const std::string& across, const std::string& up) const {
  const double across_step = tick_step(shown_.sizes().x(), 12);
  const double up_step = shown_.sizes().y() > 0.5 * shown_.sizes().x() ? across_step : tick_step(shown_.sizes().y(), 4);
  for (double v = std::ceil(shown_.min().x() / across_step) * across_step; v <= shown_.max().x() + 1e-9;
       v += across_step) {
    const double x = middle_.x() + scale_ * (v - center_.x());
    canvas_->line({x, top_left_.y()}, {x, bottom_right_.y()}, kFaint, 1);
    canvas_->text(tick_label(v, across_step), {x, bottom_right_.y() + 20}, 10, kInk, Align::kCenter);
  }
  for (double v = std::ceil(shown_.min().y() / up_step) * up_step; v <= shown_.max().y() + 1e-9; v += up_step) {
    const double y = middle_.y() - scale_ * (v - center_.y());
    canvas_->line({top_left_.x(), y}, {bottom_right_.x(), y}, kFaint, 1);
    canvas_->text(tick_label(v, up_step), {top_left_.x() - 8, y + 5}, 10, kInk, Align::kRight);
  }
  canvas_->rectangle(top_left_, bottom_right_, kAxis, 1);
  canvas_->text(title, top_left_ + Eigen::Vector2d(0, -12), 13, kInk, Align::kLeft, true);
  canvas_->text(across, {middle_.x(), bottom_right_.y() + 44}, 11, kInk, Align::kCenter);
  canvas_->vertical_text(up, {top_left_.x() - 48, middle_.y()}, 11, kInk);
}

void View::draw_box(const scene::Box& box, const cv::Scalar& color, double opacity) const {
  std::vector<cv::Point2f> corners;
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3d sign(corner & 1 ? 1 : -1, corner & 2 ? 1 : -1, corner & 4 ? 1 : -1);
    const Eigen::Vector2d p = (*this)(box.X_WO * box.half_m.cwiseProduct(sign).eval());
    corners.emplace_back(static_cast<float>(p.x()), static_cast<float>(p.y()));
  }
  std::vector<cv::Point2f> hull;
  cv::convexHull(corners, hull);
  std::vector<Eigen::Vector2d> polygon;
  for (const auto& p : hull) polygon.emplace_back(p.x, p.y);
  canvas_->polygon(polygon, color, opacity);
}

void draw_heading(Canvas* canvas, const std::string& title, const std::string& subtitle, double width,
                  const cv::Scalar& color) {
  double height = 20;
  while (height > 10 && Canvas::text_width(title, height, true) > width - 100) height -= 1;
  canvas->text(title, {80, 48}, height, color, Align::kLeft, true);
  canvas->text(subtitle, {80, 80}, 12, kInk);
}

cv::Mat depth_colors(const scene::DepthImage& depth, double max_depth_m) {
  cv::Mat colors(depth.height_px, depth.width_px, CV_8UC3, cv::Scalar(0, 0, 0));
  for (int v = 0; v < depth.height_px; ++v)
    for (int u = 0; u < depth.width_px; ++u) {
      const float depth_m = depth.depth_m[static_cast<std::size_t>(v * depth.width_px + u)];
      if (!(depth_m > 0)) continue;
      const cv::Scalar color = ramp_color(depth_m / max_depth_m);
      colors.at<cv::Vec3b>(v, u) = {static_cast<std::uint8_t>(color[0]), static_cast<std::uint8_t>(color[1]),
                                    static_cast<std::uint8_t>(color[2])};
    }
  return colors;
}

Eigen::Vector3d inside(const config::Track& track, const Eigen::Vector3d& p_W) {
  return p_W.cwiseMax(track.flight_volume.min()).cwiseMin(track.flight_volume.max());
}

std::vector<Eigen::Vector3d> opening_edge_W(const GateShape& shape, const Eigen::Isometry3d& X_WG) {
  const double c = shape.inner_half_m;
  if (shape.opening == GateShape::Opening::kSquare)
    return {X_WG * Eigen::Vector3d(0, -c, -c), X_WG * Eigen::Vector3d(0, c, -c), X_WG * Eigen::Vector3d(0, c, c),
            X_WG * Eigen::Vector3d(0, -c, c)};
  constexpr int kCorners = 32;
  std::vector<Eigen::Vector3d> edge;
  for (int i = 0; i < kCorners; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / kCorners;
    edge.push_back(X_WG * Eigen::Vector3d(0, c * std::cos(angle), c * std::sin(angle)));
  }
  return edge;
}

void fill_opening(Canvas* canvas, const View& view, const scene::Gate& gate, double opacity) {
  std::vector<Eigen::Vector2d> polygon;
  for (const Eigen::Vector3d& p_W : opening_edge_W(gate.shape, gate.X_WG)) polygon.push_back(view(p_W));
  canvas->polygon(polygon, kOpening, opacity);
}

void draw_world(Canvas* canvas, const View& view, const scene::World& world) {
  for (const auto& box : world.boxes) view.draw_box(box, kClutter, 0.45);
  for (const auto& gate : world.gates) {
    if (!view.shows(gate.X_WG.translation())) continue;
    const double c = gate.shape.inner_half_m, outer = gate.shape.outer_half_m;
    const auto at = [&](double y, double z) { return view(gate.X_WG * Eigen::Vector3d(0, y, z)); };
    fill_opening(canvas, view, gate, 0.2);  // where one may pass
    for (const auto& piece : scene::frame_boxes(gate)) view.draw_box(piece, kFrame, 0.6);
    if (!view.edge_on(gate.X_WG.linear().col(0))) continue;
    // Seen from its edge a gate is a line: green where one may pass, thick and dark where one may not.
    for (const Eigen::Vector2d& side : {Eigen::Vector2d(1, 0), Eigen::Vector2d(0, 1)}) {
      const auto along = [&](double r) { return at(r * side.x(), r * side.y()); };
      if ((along(outer) - along(-outer)).norm() < outer * view.scale()) continue;  // the side that points at the viewer
      canvas->line(along(-c), along(c), kOpening, 3);
      canvas->line(along(c), along(outer), kFrame, 6);
      canvas->line(along(-c), along(-outer), kFrame, 6);
    }
  }
}

void draw_nominal(Canvas* canvas, const View& view, const config::Track& track) {
  std::size_t drawn = 0;  // gates so far; they are numbered in the order of first passage
  for (std::size_t i = 0; i < track.course.waypoints.size(); ++i) {
    if (gate_index(track.course, i) < drawn) continue;
    ++drawn;
    const Eigen::Vector3d& p_W = track.course.waypoints[i].p_W;
    if (!view.shows(p_W)) continue;
    const Eigen::Vector2d p = view(p_W);
    canvas->circle(p, 6, kNominal, 2);
    canvas->line(p - Eigen::Vector2d(3, 0), p + Eigen::Vector2d(3, 0), kNominal, 1.5);
    canvas->line(p - Eigen::Vector2d(0, 3), p + Eigen::Vector2d(0, 3), kNominal, 1.5);
  }
}

void draw_numbers(Canvas* canvas, const View& view, const scene::World& world, const Course& course) {
  std::vector<std::string> numbers(world.gates.size());
  for (std::size_t i = 0; i < course.waypoints.size(); ++i) {
    std::string& of_gate = numbers[gate_index(course, i)];
    of_gate += (of_gate.empty() ? "" : ", ") + std::to_string(i + 1);
  }
  for (std::size_t i = 0; i < world.gates.size(); ++i) {
    const auto& gate = world.gates[i];
    if (!view.shows(gate.X_WG.translation())) continue;
    const Eigen::Vector3d p_G(0, -gate.shape.outer_half_m - 22 / view.scale(), 0);
    const Eigen::Vector2d at = view(gate.X_WG * p_G)
                                   .cwiseMax(view.top_left() + Eigen::Vector2d(14, 14))
                                   .cwiseMin(view.bottom_right() - Eigen::Vector2d(14, 14));
    canvas->text(numbers[i], at + Eigen::Vector2d(0, 7), 14, kInk, Align::kCenter, true);
  }
}

void draw_start(Canvas* canvas, const View& view, const config::Track& track) {
  const Eigen::Vector2d start = view(track.start_p_WB);
  canvas->circle(start, 6, {255, 255, 255}, -1);
  canvas->circle(start, 6, kInk, 2.5);
}

}  // namespace gatefield::simulator
