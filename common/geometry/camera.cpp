#include "common/geometry/camera.h"

#include <cmath>
#include <numbers>
#include <string>

namespace gatefield {

bool CameraModel::sees(const Eigen::Vector3d& p_C, double margin_px) const noexcept {
  if (p_C.z() < min_depth_m || p_C.z() > max_depth_m) return false;
  const double u = fx_px * p_C.x() / p_C.z() + cx_px;
  const double v = fy_px * p_C.y() / p_C.z() + cy_px;
  return u >= margin_px && u < width_px - margin_px && v >= margin_px && v < height_px - margin_px;
}

PlainIsometry forward_camera_mount(double pitch_up_rad, const Eigen::Vector3d& p_BC) {
  Eigen::Matrix3d R_BC0;  // optical axes in the body frame for a camera that looks straight ahead
  R_BC0 << 0, 0, 1,       //
      -1, 0, 0,           //
      0, -1, 0;
  PlainIsometry X_BC = PlainIsometry::Identity();
  X_BC.linear() = Eigen::AngleAxisd(-pitch_up_rad, Eigen::Vector3d::UnitY()).toRotationMatrix() * R_BC0;
  X_BC.translation() = p_BC;
  return X_BC;
}

CameraModel camera_from_fov(int width_px, int height_px, double horizontal_rad, double vertical_rad) {
  CameraModel camera;
  camera.width_px = width_px;
  camera.height_px = height_px;
  camera.fx_px = 0.5 * width_px / std::tan(0.5 * horizontal_rad);
  camera.fy_px = 0.5 * height_px / std::tan(0.5 * vertical_rad);
  camera.cx_px = 0.5 * width_px;
  camera.cy_px = 0.5 * height_px;
  return camera;
}

CameraModel default_camera() {
  constexpr double kDegree = std::numbers::pi / 180.0;
  CameraModel camera = camera_from_fov(160, 90, 87.0 * kDegree, 58.0 * kDegree);
  camera.X_BC = forward_camera_mount(15.0 * kDegree);
  return camera;
}

Status validate(const CameraModel& camera) {
  const auto wrong = [](const char* field, double value, const char* expected) {
    return Error{std::string("camera.") + field + " is " + std::to_string(value) + ", expected " + expected};
  };
  if (camera.width_px < 16 || camera.width_px > 1280) return wrong("width_px", camera.width_px, "16 to 1280");
  if (camera.height_px < 16 || camera.height_px > 1280) return wrong("height_px", camera.height_px, "16 to 1280");
  if (!(camera.fx_px > 0 && camera.fx_px < 1e5))
    return wrong("fx_px", camera.fx_px, "a positive focal length in pixels");
  if (!(camera.fy_px > 0 && camera.fy_px < 1e5))
    return wrong("fy_px", camera.fy_px, "a positive focal length in pixels");
  if (!(std::abs(camera.cx_px) < 1e5)) return wrong("cx_px", camera.cx_px, "a finite principal point in pixels");
  if (!(std::abs(camera.cy_px) < 1e5)) return wrong("cy_px", camera.cy_px, "a finite principal point in pixels");
  if (!(camera.min_depth_m > 0)) return wrong("min_depth_m", camera.min_depth_m, "more than 0 m");
  if (!(camera.max_depth_m > camera.min_depth_m && camera.max_depth_m <= 100.0))
    return wrong("max_depth_m", camera.max_depth_m, "more than min_depth_m and at most 100 m");
  if (!(camera.rate_hz >= 1 && camera.rate_hz <= 240)) return wrong("rate_hz", camera.rate_hz, "1 to 240 Hz");
  const Eigen::Matrix3d R = camera.X_BC.linear();
  if (!R.allFinite() || !(R * R.transpose()).isIdentity(1e-3) || R.determinant() < 0)
    return Error{"camera.X_BC is not a rigid transform, expected a unit quaternion for the mounting"};
  if (!camera.X_BC.translation().allFinite() || camera.X_BC.translation().norm() > 2.0)
    return wrong("X_BC.translation", camera.X_BC.translation().norm(),
                 "a finite mounting point at most 2 m from the body");
  return {};
}

}  // namespace gatefield
