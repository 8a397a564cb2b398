#pragma once

#include <Eigen/Geometry>
#include <opencv2/core.hpp>
#include <span>
#include <vector>

#include "common/geometry/camera.h"
#include "common/geometry/gate.h"
#include "server/gates/field.h"

/// Depth frames and fields as pictures, for people.
namespace gatefield::tools {

inline const cv::Scalar kInk(40, 40, 40);
inline const cv::Scalar kTruth(200, 60, 30);  ///< blue: what is true, beside what was learned

/// Red where s < 0, white at 0, green where s > 0; saturates at 1 m.
cv::Vec3b field_color(double s_m);

/// A depth frame, and how it is drawn.
struct View {
  CameraModel camera;
  Eigen::Isometry3d X_WC = Eigen::Isometry3d::Identity();
  int scale = 6;  ///< depth pixels to picture pixels

  /// Where a point appears; @pre it lies before the camera
  cv::Point pixel(const Eigen::Vector3d& p_W) const;
};

/// Grey, near is light, pixels without a return are black. @pre depth_m has the camera's width * height values
cv::Mat draw_depth(const View& view, std::span<const float> depth_m);
/// Lays s in the opening's plane over it, within half_m of the centre, where the ray of a pixel meets that plane.
void draw_field_over(cv::Mat* picture, const View& view, const gates::Field& field, const Eigen::Isometry3d& X_WG,
                     double half_m);
/// Outline of an opening (or frame) of half-width half_m in the gate's plane; the parts before the camera.
void draw_outline(cv::Mat* picture, const View& view, const Eigen::Isometry3d& X_WG, double half_m,
                  const cv::Scalar& color, GateShape::Opening opening = GateShape::Opening::kSquare);

/// A square piece of a plane: M has x to the right of the picture, y to its top.
struct MapPlane {
  Eigen::Isometry3d X_WM = Eigen::Isometry3d::Identity();
  double half_m = 2.5;
  int size_px = 300;

  cv::Point pixel(const Eigen::Vector3d& p_W) const;  ///< of the point below or above p_W
};
/// s at the middle of every pixel, row by row.
std::vector<float> map_values(const MapPlane& plane, const gates::Field& field);
cv::Mat draw_map(const MapPlane& plane, const std::vector<float>& values);
/// Where s changes its sign.
void draw_zero_line(cv::Mat* map, const MapPlane& plane, const std::vector<float>& values, const cv::Scalar& color);
/// The frame's two posts, as bars.
void draw_posts(cv::Mat* map, const MapPlane& plane, const GateShape& shape, const Eigen::Isometry3d& X_WG);
/// A dot where the camera is, when it is on the map.
void draw_eye(cv::Mat* map, const MapPlane& plane, const Eigen::Vector3d& p_WC);

void write(cv::Mat* picture, const std::string& text, cv::Point at, double size = 0.5);

}  // namespace gatefield::tools
