#pragma once

#include <Eigen/Geometry>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "client/simulator/canvas.h"
#include "common/config/scenario.h"
#include "common/scene/depth_camera.h"
#include "common/scene/world.h"

/// What the pictures of flights have in common: views of the world to scale, and the world in them.
namespace gatefield::simulator {

inline const cv::Scalar kInk(70, 60, 50);
inline const cv::Scalar kFaint(236, 232, 228);
inline const cv::Scalar kAxis(190, 184, 178);
inline const cv::Scalar kFrame(92, 64, 40);
inline const cv::Scalar kOpening(110, 170, 60);
inline const cv::Scalar kNominal(0, 120, 240);
inline const cv::Scalar kClutter(150, 150, 150);
inline const cv::Scalar kBad(40, 40, 200);
inline const cv::Scalar kGood(70, 140, 30);

/// One view: two of the world's axes on a part of the sheet, at equal scale.
class View {
 public:
  View(Canvas* canvas, const Eigen::Vector2d& top_left, const Eigen::Vector2d& size, int across, int up,
       const Eigen::AlignedBox2d& shown)
      : canvas_(canvas), across_(across), up_(up) {
    scale_ = (size.array() / shown.sizes().array()).minCoeff();
    center_ = shown.center();
    middle_ = top_left + 0.5 * scale_ * shown.sizes();
    top_left_ = middle_ - 0.5 * scale_ * shown.sizes();
    bottom_right_ = middle_ + 0.5 * scale_ * shown.sizes();
    shown_ = shown;
  }

  Eigen::Vector2d operator()(const Eigen::Vector3d& p_W) const {
    return middle_ + scale_ * Eigen::Vector2d(p_W[across_] - center_.x(), center_.y() - p_W[up_]);
  }
  double scale() const { return scale_; }
  bool edge_on(const Eigen::Vector3d& normal_W) const { return std::hypot(normal_W[across_], normal_W[up_]) > 0.9; }
  Eigen::Vector2d top_left() const { return top_left_; }
  Eigen::Vector2d bottom_right() const { return bottom_right_; }

  /// Does the view show this point?
  bool shows(const Eigen::Vector3d& p_W) const { return shown_.contains(Eigen::Vector2d(p_W[across_], p_W[up_])); }

  void draw_axes(const std::string& title, const std::string& across, const std::string& up) const;

  void draw_box(const scene::Box& box, const cv::Scalar& color, double opacity) const;

 private:
  Canvas* canvas_;
  int across_, up_;
  double scale_;
  Eigen::Vector2d center_, middle_, top_left_, bottom_right_;
  Eigen::AlignedBox2d shown_;
};

/// Title and, under it, a subtitle over a sheet of that width; a long title is written smaller.
void draw_heading(Canvas* canvas, const std::string& title, const std::string& subtitle, double width,
                  const cv::Scalar& color = kInk);

/// A depth image in colours, near to far; pixels without a return are black.
cv::Mat depth_colors(const scene::DepthImage& depth, double max_depth_m);

/// Nearest point of the flight volume: a vehicle that ran away does not shrink the picture to nothing.
Eigen::Vector3d inside(const config::Track& track, const Eigen::Vector3d& p_W);

/// Corners around a gate's opening: four, or 32 on the circle of a round one.
std::vector<Eigen::Vector3d> opening_edge_W(const GateShape& shape, const Eigen::Isometry3d& X_WG);
void fill_opening(Canvas* canvas, const View& view, const scene::Gate& gate, double opacity);

/// Obstacles and true gates, their openings in green. Gates that the view doesn't show are left out.
void draw_world(Canvas* canvas, const View& view, const scene::World& world);
/// Where the gates nominally are, each once.
void draw_nominal(Canvas* canvas, const View& view, const config::Track& track);
/// Each gate's numbers in the lap, to the right of who passes it first: "2", or "1, 3" of one that is passed twice.
void draw_numbers(Canvas* canvas, const View& view, const scene::World& world, const Course& course);
void draw_start(Canvas* canvas, const View& view, const config::Track& track);

}  // namespace gatefield::simulator
