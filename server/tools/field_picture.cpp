#include "server/tools/field_picture.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <string>

namespace gatefield::tools {
namespace {

constexpr double kNearest_m = 0.05;  ///< of what is drawn into a depth frame

std::vector<float> evaluate(const gates::Field& field, const std::vector<Eigen::Vector3d>& points_W) {
  std::vector<float> x, y, z, s(points_W.size());
  for (const Eigen::Vector3d& p : points_W) {
    x.push_back(static_cast<float>(p.x()));
    y.push_back(static_cast<float>(p.y()));
    z.push_back(static_cast<float>(p.z()));
  }
  field.evaluate(x, y, z, s);
  return s;
}

}  // namespace

cv::Vec3b field_color(double s_m) {
  const double share = std::clamp(std::abs(s_m), 0.0, 1.0);
  const auto mix = [share](int end) { return cv::saturate_cast<uchar>(255.0 + share * (end - 255)); };
  return s_m >= 0 ? cv::Vec3b(mix(60), mix(150), mix(20)) : cv::Vec3b(mix(30), mix(30), mix(190));
}

cv::Point View::pixel(const Eigen::Vector3d& p_W) const {
  const Eigen::Vector3d p_C = X_WC.inverse() * p_W;
  return {cvRound(scale * (camera.fx_px * p_C.x() / p_C.z() + camera.cx_px)),
          cvRound(scale * (camera.fy_px * p_C.y() / p_C.z() + camera.cy_px))};
}

cv::Mat draw_depth(const View& view, std::span<const float> depth_m) {
  const CameraModel& camera = view.camera;
  cv::Mat picture(camera.height_px * view.scale, camera.width_px * view.scale, CV_8UC3, cv::Scalar(0, 0, 0));
  for (int row = 0; row < picture.rows; ++row) {
    for (int column = 0; column < picture.cols; ++column) {
      const float z_m = depth_m[static_cast<std::size_t>(row / view.scale * camera.width_px + column / view.scale)];
      if (z_m <= 0.0f) continue;
      const auto level = cv::saturate_cast<uchar>(240.0 - 190.0 * z_m / camera.max_depth_m);
      picture.at<cv::Vec3b>(row, column) = {level, level, level};
    }
  }
  return picture;
}

void draw_field_over(cv::Mat* picture, const View& view, const gates::Field& field, const Eigen::Isometry3d& X_WG,
                     double half_m) {
  const CameraModel& camera = view.camera;
  const Eigen::Vector3d normal_W = X_WG.linear().col(0);
  std::vector<Eigen::Vector3d> points_W;
  std::vector<cv::Point> pixels;
  for (int row = 0; row < picture->rows; ++row) {
    for (int column = 0; column < picture->cols; ++column) {
      const Eigen::Vector3d ray_C(((column + 0.5) / view.scale - camera.cx_px) / camera.fx_px,
                                  ((row + 0.5) / view.scale - camera.cy_px) / camera.fy_px, 1.0);
      const Eigen::Vector3d ray_W = view.X_WC.linear() * ray_C;
      const double toward = normal_W.dot(ray_W);
      if (std::abs(toward) < 1e-6) continue;
      const double depth_m = normal_W.dot(X_WG.translation() - view.X_WC.translation()) / toward;
      const Eigen::Vector3d p_W = view.X_WC.translation() + depth_m * ray_W;
      if (depth_m < kNearest_m || (p_W - X_WG.translation()).cwiseAbs().maxCoeff() > half_m) continue;
      points_W.push_back(p_W);
      pixels.emplace_back(column, row);
    }
  }
  const std::vector<float> s = evaluate(field, points_W);
  for (std::size_t i = 0; i < s.size(); ++i) {
    cv::Vec3b& pixel = picture->at<cv::Vec3b>(pixels[i]);
    const cv::Vec3b color = field_color(s[i]);
    for (int channel = 0; channel < 3; ++channel)
      pixel[channel] = static_cast<uchar>((pixel[channel] + 2 * color[channel]) / 3);
  }
}

void draw_outline(cv::Mat* picture, const View& view, const Eigen::Isometry3d& X_WG, double half_m,
                  const cv::Scalar& color, GateShape::Opening opening) {
  // In short pieces, so that an outline that is partly behind the camera is drawn as far as it is seen.
  constexpr int kPieces = 40;
  const Eigen::Vector2d corners[] = {{1, 1}, {1, -1}, {-1, -1}, {-1, 1}, {1, 1}};
  const Eigen::Isometry3d X_CG = view.X_WC.inverse() * X_WG;
  for (int side = 0; side < 4; ++side) {
    for (int piece = 0; piece < kPieces; ++piece) {
      cv::Point ends[2];
      bool seen = true;
      for (int end = 0; end < 2; ++end) {
        const double part = static_cast<double>(piece + end) / kPieces;
        const Eigen::Vector2d on_square = (1.0 - part) * corners[side] + part * corners[side + 1];
        const Eigen::Vector2d at =
            half_m * (opening == GateShape::Opening::kRound ? on_square.normalized() : on_square);
        const Eigen::Vector3d p_G(0.0, at.x(), at.y());
        seen = seen && (X_CG * p_G).z() > kNearest_m;
        if (seen) ends[end] = view.pixel(X_WG * p_G);
      }
      if (seen) cv::line(*picture, ends[0], ends[1], color, 2, cv::LINE_AA);
    }
  }
}

cv::Point MapPlane::pixel(const Eigen::Vector3d& p_W) const {
  const Eigen::Vector3d p_M = X_WM.inverse() * p_W;
  const double metre_px = size_px / (2.0 * half_m);
  return {cvRound((p_M.x() + half_m) * metre_px), cvRound((half_m - p_M.y()) * metre_px)};
}

std::vector<float> map_values(const MapPlane& plane, const gates::Field& field) {
  const double metre_px = plane.size_px / (2.0 * plane.half_m);
  std::vector<Eigen::Vector3d> points_W;
  for (int row = 0; row < plane.size_px; ++row) {
    for (int column = 0; column < plane.size_px; ++column) {
      points_W.emplace_back(plane.X_WM * Eigen::Vector3d((column + 0.5) / metre_px - plane.half_m,
                                                         plane.half_m - (row + 0.5) / metre_px, 0.0));
    }
  }
  return evaluate(field, points_W);
}

cv::Mat draw_map(const MapPlane& plane, const std::vector<float>& values) {
  cv::Mat map(plane.size_px, plane.size_px, CV_8UC3);
  for (int row = 0; row < plane.size_px; ++row)
    for (int column = 0; column < plane.size_px; ++column)
      map.at<cv::Vec3b>(row, column) = field_color(values[static_cast<std::size_t>(row * plane.size_px + column)]);
  return map;
}

void draw_zero_line(cv::Mat* map, const MapPlane& plane, const std::vector<float>& values, const cv::Scalar& color) {
  const auto positive = [&](int row, int column) {
    return values[static_cast<std::size_t>(row * plane.size_px + column)] > 0.0f;
  };
  const cv::Vec3b pixel(cv::saturate_cast<uchar>(color[0]), cv::saturate_cast<uchar>(color[1]),
                        cv::saturate_cast<uchar>(color[2]));
  for (int row = 1; row < plane.size_px; ++row) {
    for (int column = 1; column < plane.size_px; ++column) {
      const bool here = positive(row, column);
      if (here == positive(row - 1, column) && here == positive(row, column - 1)) continue;
      for (const auto& [up, left] : {std::pair{0, 0}, {1, 0}, {0, 1}})
        map->at<cv::Vec3b>(row - up, column - left) = pixel;
    }
  }
}

void draw_posts(cv::Mat* map, const MapPlane& plane, const GateShape& shape, const Eigen::Isometry3d& X_WG) {
  for (const double side : {-1.0, 1.0})
    cv::line(*map, plane.pixel(X_WG * Eigen::Vector3d(0, side * shape.inner_half_m, 0)),
             plane.pixel(X_WG * Eigen::Vector3d(0, side * shape.outer_half_m, 0)), kTruth, 5, cv::LINE_AA);
}

void draw_eye(cv::Mat* map, const MapPlane& plane, const Eigen::Vector3d& p_WC) {
  const cv::Point eye = plane.pixel(p_WC);
  if (cv::Rect(0, 0, plane.size_px, plane.size_px).contains(eye))
    cv::circle(*map, eye, 5, kInk, cv::FILLED, cv::LINE_AA);
}

void write(cv::Mat* picture, const std::string& text, cv::Point at, double size) {
  cv::putText(*picture, text, at, cv::FONT_HERSHEY_SIMPLEX, size, kInk, 1, cv::LINE_AA);
}

}  // namespace gatefield::tools
