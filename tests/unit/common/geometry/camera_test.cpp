#include "common/geometry/camera.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>

namespace gatefield {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

TEST(Camera, DefaultIsTheOneOfTheExperiments) {
  const CameraModel camera = default_camera();
  EXPECT_TRUE(validate(camera).ok());
  EXPECT_EQ(camera.width_px, 160);
  EXPECT_EQ(camera.height_px, 90);
  EXPECT_DOUBLE_EQ(camera.min_depth_m, 0.3);
  EXPECT_DOUBLE_EQ(camera.max_depth_m, 10.0);
  // Full fields of view, from edge to edge.
  EXPECT_NEAR(2.0 * std::atan(80.0 / camera.fx_px), 87.0 * kDegree, 1e-12);
  EXPECT_NEAR(2.0 * std::atan(45.0 / camera.fy_px), 58.0 * kDegree, 1e-12);
}

TEST(Camera, PixelCentresLieAtHalves) {
  const CameraModel camera = camera_from_fov(160, 90, 90.0 * kDegree, 60.0 * kDegree);
  // The principal point is the corner between the four middle pixels: their rays lie symmetrically about the axis.
  const Eigen::Vector3d left_above = camera.ray_C(79, 44);
  const Eigen::Vector3d right_below = camera.ray_C(80, 45);
  EXPECT_NEAR(left_above.x(), -right_below.x(), 1e-15);
  EXPECT_NEAR(left_above.y(), -right_below.y(), 1e-15);
  EXPECT_NEAR(right_below.x(), 0.5 / camera.fx_px, 1e-15);
  EXPECT_DOUBLE_EQ(left_above.z(), 1.0);
  // tan(45 deg) = 1 at the image's edge, half a pixel outside of the last centre.
  EXPECT_NEAR(camera.ray_C(159, 0).x(), 1.0 - 0.5 / camera.fx_px, 1e-12);
}

TEST(Camera, DistortionIsMeasuredWhereItMovesMost) {
  CameraModel camera = default_camera();
  EXPECT_EQ(largest_distortion_px(camera), 0.0);
  camera.distortion_model = CameraModel::Distortion::kBrownConrady;
  EXPECT_EQ(largest_distortion_px(camera), 0.0);
  camera.distortion[0] = 0.01;
  // k1 r^3 at a corner, in pixels along its ray.
  const double x = 80.0 / camera.fx_px, y = 45.0 / camera.fy_px, r2 = x * x + y * y;
  EXPECT_NEAR(largest_distortion_px(camera), 0.01 * r2 * std::hypot(80.0, 45.0), 1e-9);
  camera.distortion[0] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(validate(camera).ok());
}

TEST(Camera, ALittleDistortionIsTakenAndMoreIsRefused) {
  CameraModel camera = default_camera();
  camera.distortion_model = CameraModel::Distortion::kBrownConrady;
  camera.distortion[0] = 0.005;
  EXPECT_TRUE(validate(camera).ok());
  camera.distortion[0] = -0.05;
  const Status status = validate(camera);
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.failure().field, "camera.distortion");
  EXPECT_THAT(status.error(), testing::HasSubstr("send rectified ones"));
}

TEST(Camera, SeesWhatProjectsIntoTheImageWithinTheDepthRange) {
  const CameraModel camera = default_camera();
  EXPECT_TRUE(camera.sees({0, 0, 5}));
  EXPECT_FALSE(camera.sees({0, 0, 0.29}));
  EXPECT_FALSE(camera.sees({0, 0, 10.01}));
  EXPECT_FALSE(camera.sees({0, 0, -5}));
  const double edge = 80.0 / camera.fx_px;
  EXPECT_TRUE(camera.sees({0.999 * edge * 4, 0, 4}));
  EXPECT_FALSE(camera.sees({1.001 * edge * 4, 0, 4}));
  EXPECT_FALSE(camera.sees({0.999 * edge * 4, 0, 4}, 2.0));
}

TEST(Camera, MountTurnsOpticalAxesIntoTheBody) {
  const Eigen::Isometry3d X_BC = forward_camera_mount(15.0 * kDegree, {0.1, 0.0, 0.02});
  // Optical z looks along body x, turned up; optical x is body right; optical y is down.
  EXPECT_TRUE((X_BC.linear() * Eigen::Vector3d::UnitZ())
                  .isApprox(Eigen::Vector3d(std::cos(15.0 * kDegree), 0, std::sin(15.0 * kDegree)), 1e-12));
  EXPECT_TRUE((X_BC.linear() * Eigen::Vector3d::UnitX()).isApprox(-Eigen::Vector3d::UnitY(), 1e-12));
  EXPECT_LT((X_BC.linear() * Eigen::Vector3d::UnitY()).z(), 0.0);
  EXPECT_NEAR(X_BC.linear().determinant(), 1.0, 1e-12);
  EXPECT_TRUE(X_BC.translation().isApprox(Eigen::Vector3d(0.1, 0, 0.02)));
}

struct Fault {
  const char* field;
  void (*spoil)(CameraModel*);
};

class CameraValidation : public testing::TestWithParam<Fault> {};

TEST_P(CameraValidation, NamesTheField) {
  CameraModel camera = default_camera();
  GetParam().spoil(&camera);
  const Status status = validate(camera);
  ASSERT_FALSE(status.ok());
  EXPECT_THAT(status.error(), testing::HasSubstr(std::string("camera.") + GetParam().field));
  EXPECT_EQ(status.failure().code, ErrorCode::kInvalid);
}

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
INSTANTIATE_TEST_SUITE_P(EveryField, CameraValidation,
                         testing::Values(Fault{"width_px", [](CameraModel* c) { c->width_px = 15; }},
                                         Fault{"height_px", [](CameraModel* c) { c->height_px = 1281; }},
                                         Fault{"fx_px", [](CameraModel* c) { c->fx_px = 0; }},
                                         Fault{"fy_px", [](CameraModel* c) { c->fy_px = kNan; }},
                                         Fault{"cx_px", [](CameraModel* c) { c->cx_px = kNan; }},
                                         Fault{"cy_px", [](CameraModel* c) { c->cy_px = 1e6; }},
                                         Fault{"cx_px", [](CameraModel* c) { c->cx_px = 320; }},
                                         Fault{"cx_px", [](CameraModel* c) { c->cx_px = -1; }},
                                         Fault{"cy_px", [](CameraModel* c) { c->cy_px = 90.5; }},
                                         Fault{"min_depth_m", [](CameraModel* c) { c->min_depth_m = 0; }},
                                         Fault{"max_depth_m", [](CameraModel* c) { c->max_depth_m = 0.2; }},
                                         Fault{"rate_hz", [](CameraModel* c) { c->rate_hz = 0.5; }},
                                         Fault{"X_BC", [](CameraModel* c) { c->X_BC.linear() *= 1.1; }},
                                         Fault{"X_BC", [](CameraModel* c) { c->X_BC.linear().col(0) *= -1; }},
                                         Fault{"X_BC.translation",
                                               [](CameraModel* c) { c->X_BC.translation().x() = 3; }}),
                         [](const auto& test) {
                           std::string name = test.param.field + std::to_string(test.index);
                           std::replace(name.begin(), name.end(), '.', '_');
                           return name;
                         });

}  // namespace
}  // namespace gatefield
