#include "server/baseline/classical_detector.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "common/base/random.h"

namespace gatefield::baseline {
namespace {

constexpr double kCrop_m = 1.45;  ///< around the prior: a corner of the frame and half a metre of doubt
constexpr double kSlice_m = 1.6;  ///< without a prior: depth of a slice that is looked at by itself
constexpr std::size_t kFewestPoints = 40;
constexpr int kTrials = 160;      ///< of RANSAC
constexpr double kCell_m = 0.05;  ///< of the map of the plane
constexpr int kMapCells = 81;     ///< it is 4 m wide
constexpr int kMiddleCell = kMapCells / 2;
constexpr int kTurns = 12;       ///< over 90 degrees
constexpr double kMaxUp = 0.65;  ///< of a plane's normal along the camera's vertical: what lies flatter is floor
constexpr double kLowestScore = 0.4;
constexpr float kNothingBack = -0.5f;

/// How far a point of a plane may lie off it: the sensor's noise grows with the square of the distance.
double tolerance_m(double z_m) { return 0.04 + 0.0025 * z_m * z_m; }

struct Plane {
  Eigen::Vector3d normal_C = Eigen::Vector3d::UnitZ();  ///< away from the camera
  double offset_m = 0.0;                                ///< n . p
  std::size_t inliers = 0;
};

Plane through(const Eigen::Vector3d& normal, const Eigen::Vector3d& point) {
  Plane plane{normal, normal.dot(point), 0};
  if (plane.offset_m < 0) {
    plane.normal_C = -plane.normal_C;
    plane.offset_m = -plane.offset_m;
  }
  return plane;
}

bool on(const Plane& plane, const Eigen::Vector3d& p_C) {
  return std::abs(plane.normal_C.dot(p_C) - plane.offset_m) < tolerance_m(p_C.z());
}

/// The plane with the most points, refined by least squares over them.
std::optional<Plane> fit_plane(const std::vector<Eigen::Vector3d>& points_C) {
  if (points_C.size() < kFewestPoints) return std::nullopt;
  Random random(points_C.size(), Stream("gatefield.ransac"));  // the same image gives the same plane
  const auto any = [&]() -> const Eigen::Vector3d& {
    const auto i = static_cast<std::size_t>(random.uniform() * static_cast<double>(points_C.size()));
    return points_C[std::min(i, points_C.size() - 1)];
  };
  Plane best;
  for (int trial = 0; trial < kTrials; ++trial) {
    const Eigen::Vector3d& a = any();
    const Eigen::Vector3d normal = (any() - a).cross(any() - a);
    if (normal.norm() < 0.02 || std::abs(normal.y()) > kMaxUp * normal.norm()) continue;
    Plane plane = through(normal.normalized(), a);
    plane.inliers = static_cast<std::size_t>(
        std::count_if(points_C.begin(), points_C.end(), [&](const Eigen::Vector3d& p) { return on(plane, p); }));
    if (plane.inliers > best.inliers) best = plane;
  }
  for (int round = 0; round < 2 && best.inliers >= kFewestPoints; ++round) {
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    double sum = 0.0;
    for (const Eigen::Vector3d& p : points_C)
      if (on(best, p)) {
        const double weight = 1.0 / std::pow(tolerance_m(p.z()), 2);
        mean += weight * p;
        sum += weight;
      }
    mean /= sum;
    Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
    for (const Eigen::Vector3d& p : points_C)
      if (on(best, p)) spread += (p - mean) * (p - mean).transpose() / std::pow(tolerance_m(p.z()), 2);
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(spread);
    best = through(solver.eigenvectors().col(0), mean);
    best.inliers = static_cast<std::size_t>(
        std::count_if(points_C.begin(), points_C.end(), [&](const Eigen::Vector3d& p) { return on(best, p); }));
  }
  if (best.inliers < kFewestPoints) return std::nullopt;
  return best;
}

/// What the image says of the spots of a plane: 1 something is there, -1 the view goes through to something behind,
/// -0.5 nothing came back (most likely nothing is in range), 0 not known.
cv::Mat map_of(std::span<const float> depth_m, const CameraModel& camera, const Eigen::Isometry3d& X_CP) {
  cv::Mat map(kMapCells, kMapCells, CV_32F, cv::Scalar(0));
  for (int row = 0; row < kMapCells; ++row)
    for (int column = 0; column < kMapCells; ++column) {
      const Eigen::Vector3d p_P(0, (column - kMiddleCell) * kCell_m, (row - kMiddleCell) * kCell_m);
      const Eigen::Vector3d p_C = X_CP * p_P;
      if (!camera.sees(p_C)) continue;
      const int u = static_cast<int>(camera.cx_px + camera.fx_px * p_C.x() / p_C.z());
      const int v = static_cast<int>(camera.cy_px + camera.fy_px * p_C.y() / p_C.z());
      const double z = depth_m[static_cast<std::size_t>(v * camera.width_px + u)];
      if (z <= 0) {
        map.at<float>(row, column) = kNothingBack;
        continue;
      }
      const double off_m = z - p_C.z(), allowed_m = 2.0 * tolerance_m(p_C.z());
      map.at<float>(row, column) = off_m > allowed_m ? -1.0f : off_m > -allowed_m ? 1.0f : 0.0f;
    }
  return map;
}

/// 1 over the frame and -1 over the opening and around the frame, each part summing up to 0.5, 0.35 and 0.15.
cv::Mat template_of(const GateShape& shape, double turn_rad) {
  const bool round = shape.opening == GateShape::Opening::kRound;
  const double around_m = shape.outer_half_m + 0.2;
  const int half = static_cast<int>(std::ceil(around_m * (round ? 1.0 : std::numbers::sqrt2) / kCell_m));
  cv::Mat parts[3];
  for (cv::Mat& part : parts) part = cv::Mat(2 * half + 1, 2 * half + 1, CV_32F, cv::Scalar(0));
  const Eigen::Rotation2Dd turn(-turn_rad);
  for (int row = -half; row <= half; ++row)
    for (int column = -half; column <= half; ++column) {
      const Eigen::Vector2d p = turn * Eigen::Vector2d(column * kCell_m, row * kCell_m);
      const double r = round ? p.norm() : p.cwiseAbs().maxCoeff();
      const int part = r < shape.inner_half_m ? 1 : r < shape.outer_half_m ? 0 : r < around_m ? 2 : -1;
      if (part >= 0) parts[part].at<float>(row + half, column + half) = 1.0f;
    }
  return parts[0] * (0.5 / cv::sum(parts[0])[0]) - parts[1] * (0.35 / cv::sum(parts[1])[0]) -
         parts[2] * (0.15 / cv::sum(parts[2])[0]);
}

struct Place {
  double y_m = 0.0, z_m = 0.0, turn_rad = 0.0, score = 0.0;
};

Place slide(const cv::Mat& map, const GateShape& shape) {
  Place best;
  const int turns = shape.opening == GateShape::Opening::kRound ? 1 : kTurns;
  const int middle_turn = turns / 2;
  for (int i = 0; i < turns; ++i) {
    const double turn_rad = 0.5 * std::numbers::pi * (i - middle_turn) / turns;
    const cv::Mat shape_map = template_of(shape, turn_rad);
    if (shape_map.rows >= map.rows) continue;
    cv::Mat score;
    cv::matchTemplate(map, shape_map, score, cv::TM_CCORR);
    double highest;
    cv::Point at;
    cv::minMaxLoc(score, nullptr, &highest, nullptr, &at);
    if (highest <= best.score) continue;
    // Between the cells: the middle of what scores nearly as much.
    double sum = 0.0, y = 0.0, z = 0.0;
    for (int row = std::max(0, at.y - 3); row <= std::min(score.rows - 1, at.y + 3); ++row)
      for (int column = std::max(0, at.x - 3); column <= std::min(score.cols - 1, at.x + 3); ++column) {
        const double weight = std::pow(std::max(0.0, score.at<float>(row, column) - 0.8 * highest), 2);
        sum += weight, y += weight * column, z += weight * row;
      }
    const double middle = 0.5 * (shape_map.rows - 1) - kMiddleCell;
    best = {(y / sum + middle) * kCell_m, (z / sum + middle) * kCell_m, turn_rad, highest};
  }
  return best;
}

}  // namespace

std::optional<Detection> ClassicalDetector::in_points(std::span<const float> depth_m, const CameraModel& camera,
                                                      const std::optional<Eigen::Vector3d>& prior_C) {
  const auto plane = fit_plane(points_C_);
  if (!plane) return std::nullopt;
  Eigen::Vector3d middle_C = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : points_C_)
    if (on(*plane, p)) middle_C += p / static_cast<double>(plane->inliers);
  if (prior_C) middle_C = *prior_C;
  middle_C -= (plane->normal_C.dot(middle_C) - plane->offset_m) * plane->normal_C;

  // The plane's frame: x through it, z as near to the camera's up as that allows.
  Eigen::Isometry3d X_CP = Eigen::Isometry3d::Identity();
  const Eigen::Vector3d up_C = -Eigen::Vector3d::UnitY();
  const Eigen::Vector3d y = up_C.cross(plane->normal_C);
  if (y.norm() < 0.2) return std::nullopt;  // the least squares ended on a floor
  X_CP.linear() << plane->normal_C, y.normalized(), plane->normal_C.cross(y.normalized());
  X_CP.translation() = middle_C;

  const Place place = slide(map_of(depth_m, camera, X_CP), shape_);
  if (place.score < kLowestScore) return std::nullopt;
  Detection found;
  found.score = place.score;
  const Eigen::Isometry3d X_CG = X_CP * Eigen::Translation3d(0, place.y_m, place.z_m) *
                                 Eigen::AngleAxisd(place.turn_rad, Eigen::Vector3d::UnitX());
  found.X_CG = X_CG.cast<float>();
  return found;
}

std::optional<Detection> ClassicalDetector::detect(std::span<const float> depth_m, const CameraModel& camera,
                                                   const std::optional<Eigen::Vector3d>& prior_C) {
  const auto gather = [&](const auto& wanted) {
    points_C_.clear();
    for (int v = 0; v < camera.height_px; ++v)
      for (int u = 0; u < camera.width_px; ++u) {
        const double z = depth_m[static_cast<std::size_t>(v * camera.width_px + u)];
        if (z <= 0) continue;
        const Eigen::Vector3d p_C = z * camera.ray_C(u, v);
        if (wanted(p_C)) points_C_.push_back(p_C);
      }
  };
  if (prior_C) {
    gather([&](const Eigen::Vector3d& p_C) { return (p_C - *prior_C).norm() < kCrop_m; });
    return in_points(depth_m, camera, prior_C);
  }
  for (double near_m = camera.min_depth_m; near_m < camera.max_depth_m; near_m += 0.5 * kSlice_m) {
    gather([&](const Eigen::Vector3d& p_C) { return p_C.z() >= near_m && p_C.z() < near_m + kSlice_m; });
    if (auto found = in_points(depth_m, camera, std::nullopt)) return found;
  }
  return std::nullopt;
}

}  // namespace gatefield::baseline
