#pragma once

#include <Eigen/Geometry>

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

/// Says which field is wrong and why: sizes 16..1280, focal lengths > 0, 0 < min < max <= 100 m, rate 1..240 Hz, rigid
/// mounting.
Status validate(const CameraModel& camera);

}  // namespace gatefield
