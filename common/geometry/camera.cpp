#include "common/geometry/camera.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>

#include "common/base/text.h"

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

double largest_distortion_px(const CameraModel& camera) noexcept {
  if (camera.distortion_model == CameraModel::Distortion::kNone) return 0.0;
  const auto& [k1, k2, p1, p2, k3] = camera.distortion;
  constexpr int kSteps = 16;
  double largest_px = 0.0;
  for (int i = 0; i <= kSteps; ++i) {
    for (int j = 0; j <= kSteps; ++j) {
      const double x = (camera.width_px * static_cast<double>(i) / kSteps - camera.cx_px) / camera.fx_px;
      const double y = (camera.height_px * static_cast<double>(j) / kSteps - camera.cy_px) / camera.fy_px;
      const double r2 = x * x + y * y;
      const double radial = r2 * (k1 + r2 * (k2 + r2 * k3));
      const double dx = x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x);
      const double dy = y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y;
      const double moved_px = std::hypot(camera.fx_px * dx, camera.fy_px * dy);
      if (!std::isfinite(moved_px)) return std::numeric_limits<double>::infinity();
      largest_px = std::max(largest_px, moved_px);
    }
  }
  return largest_px;
}

Status validate(const CameraModel& camera) {
  const auto wrong = [](const char* field, double value, const char* expected) {
    return Error::invalid(std::string("camera.") + field, text(value), expected);
  };
  if (camera.width_px < 16 || camera.width_px > 1280) return wrong("width_px", camera.width_px, "16 to 1280");
  if (camera.height_px < 16 || camera.height_px > 1280) return wrong("height_px", camera.height_px, "16 to 1280");
  if (!(camera.fx_px > 0 && camera.fx_px < 1e5))
    return wrong("fx_px", camera.fx_px, "a positive focal length in pixels");
  if (!(camera.fy_px > 0 && camera.fy_px < 1e5))
    return wrong("fy_px", camera.fy_px, "a positive focal length in pixels");
  const auto outside = [](const char* field, double value, int size_px) {
    return Error::invalid(std::string("camera.") + field, text(value),
                          "0 to " + text(size_px) +
                              ", a principal point inside the image (are focal lengths and principal point those of "
                              "the image as it is sent, after binning or decimation?)");
  };
  if (!(camera.cx_px >= 0 && camera.cx_px <= camera.width_px)) return outside("cx_px", camera.cx_px, camera.width_px);
  if (!(camera.cy_px >= 0 && camera.cy_px <= camera.height_px)) return outside("cy_px", camera.cy_px, camera.height_px);
  if (!(camera.min_depth_m > 0)) return wrong("min_depth_m", camera.min_depth_m, "more than 0 m");
  if (!(camera.max_depth_m > camera.min_depth_m && camera.max_depth_m <= 100.0))
    return wrong("max_depth_m", camera.max_depth_m, "more than min_depth_m and at most 100 m");
  if (!(camera.rate_hz >= 1 && camera.rate_hz <= 240)) return wrong("rate_hz", camera.rate_hz, "1 to 240 Hz");
  const Eigen::Matrix3d R = camera.X_BC.linear();
  if (!R.allFinite() || !(R * R.transpose()).isIdentity(1e-3) || R.determinant() < 0)
    return Error::invalid("camera.X_BC", "not a rigid transform", "a unit quaternion for the mounting");
  if (!camera.X_BC.translation().allFinite() || camera.X_BC.translation().norm() > 2.0)
    return wrong("X_BC.translation", camera.X_BC.translation().norm(),
                 "a finite mounting point at most 2 m from the body");
  if (!(camera.metres_per_count >= 1e-6 && camera.metres_per_count <= 0.1))
    return wrong("metres_per_count", camera.metres_per_count, "1e-6 to 0.1 m (0.001 for millimetres)");
  if (camera.distortion_model != CameraModel::Distortion::kNone &&
      camera.distortion_model != CameraModel::Distortion::kBrownConrady)
    return wrong("distortion_model", static_cast<int>(camera.distortion_model), "0 (none) or 1 (k1, k2, p1, p2, k3)");
  if (const double moved_px = largest_distortion_px(camera); !(moved_px <= CameraModel::kMaxDistortion_px))
    return Error::invalid("camera.distortion", "one that moves a pixel by " + text(moved_px) + " px",
                          "at most " + text(CameraModel::kMaxDistortion_px) +
                              " px, since images are used as they come: send rectified ones");
  return {};
}

}  // namespace gatefield
