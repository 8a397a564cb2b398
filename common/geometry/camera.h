#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>

#include "common/base/plain.h"
#include "common/base/result.h"

namespace gatefield {

/// A depth camera: pinhole, z-depth (not ray length). Frame C is optical: x right, y down, z forward.
/// Pixel (u, v) = (column, row); its centre lies at (u + 0.5, v + 0.5), so cx = width / 2 is the middle of the image.
struct CameraModel {
  int width_px = 160;
  int height_px = 90;
  double fx_px = 0.0;
  double fy_px = 0.0;
  double cx_px = 0.0;
  double cy_px = 0.0;
  double min_depth_m = 0.3;   ///< nearer returns are invalid
  double max_depth_m = 10.0;  ///< farther returns are invalid
  double rate_hz = 60.0;
  PlainIsometry X_BC = PlainIsometry::Identity();  ///< mounting: camera in the body frame
  double metres_per_count = 1e-3;                  ///< of 16-bit images: depth of one count
  enum class Distortion : std::uint8_t { kNone = 0, kBrownConrady = 1 };
  Distortion distortion_model = Distortion::kNone;
  /// kBrownConrady: k1, k2, p1, p2, k3, as OpenCV and ROS's plumb_bob have them. Images are used as they come, so what
  /// moves a pixel farther than kMaxDistortion_px is refused: rectify them first.
  std::array<double, 5> distortion{};
  static constexpr double kMaxDistortion_px = 1.0;

  /// Camera-frame ray through the centre of a pixel, with z = 1.
  Eigen::Vector3d ray_C(int u, int v) const noexcept {
    return {(u + 0.5 - cx_px) / fx_px, (v + 0.5 - cy_px) / fy_px, 1.0};
  }
  /// True when the point lies in the image and in the depth range; `margin_px` shrinks the image at every side.
  bool sees(const Eigen::Vector3d& p_C, double margin_px = 0.0) const noexcept;
};

/// Mounting of a camera that looks along the body's x axis, turned up by `pitch_up_rad`, at `p_BC` in the body frame.
PlainIsometry forward_camera_mount(double pitch_up_rad, const Eigen::Vector3d& p_BC = Eigen::Vector3d::Zero());

/// Pinhole model from full fields of view.
CameraModel camera_from_fov(int width_px, int height_px, double horizontal_rad, double vertical_rad);

/// The camera of the project's experiments: 160 x 90, 87 x 58 deg, 0.3 to 10 m, 15 deg up (Intel D435-like).
CameraModel default_camera();

/// How far the distortion moves the pixel that it moves most, px: over a grid of 17 x 17 points that has the image's
/// corners,
///   d = x (k1 r^2 + k2 r^4 + k3 r^6) + (2 p1 x y + p2 (r^2 + 2 x^2), p1 (r^2 + 2 y^2) + 2 p2 x y), times (fx, fy),
/// x, y on the plane z = 1 (Brown, "Decentering distortion of lenses", 1966; OpenCV's camera model).
double largest_distortion_px(const CameraModel& camera) noexcept;

/// Says which field is wrong and why: sizes 16..1280, focal lengths > 0, principal point inside the image (0 to width,
/// 0 to height), 0 < min < max <= 100 m, rate 1..240 Hz, rigid mounting at most 2 m from the body's origin,
/// metres_per_count 1e-6..0.1, a distortion of kMaxDistortion_px at most.
/// Errors: kInvalid with the field ("camera.cx_px").
Status validate(const CameraModel& camera);

}  // namespace gatefield
