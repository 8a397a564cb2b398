#include "server/tools/field_picture.h"

#include <gtest/gtest.h>

#include "server/gates/analytic_field.h"

namespace gatefield::tools {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

int pixels_like(const cv::Mat& picture, const cv::Vec3b& color) {
  int count = 0;
  for (int row = 0; row < picture.rows; ++row)
    for (int column = 0; column < picture.cols; ++column) count += picture.at<cv::Vec3b>(row, column) == color ? 1 : 0;
  return count;
}

TEST(FieldColor, GreenInsideRedOutsideWhiteBetween) {
  EXPECT_EQ(field_color(0.0), cv::Vec3b(255, 255, 255));
  EXPECT_GT(field_color(0.5)[1], field_color(0.5)[2]);
  EXPECT_GT(field_color(-0.5)[2], field_color(-0.5)[1]);
  EXPECT_EQ(field_color(1.0), field_color(7.0));
}

TEST(Map, ShowsTheHourglassWhereItIs) {
  MapPlane plane;
  plane.half_m = 2.0;
  plane.size_px = 400;
  plane.X_WM.translation() = Vector3d(10.0, 0.0, 1.0);
  Isometry3d X_WG = Isometry3d::Identity();
  X_WG.translation() = Vector3d(10.5, 0.0, 1.0);
  const std::vector<float> values = map_values(plane, gates::AnalyticField(X_WG));
  // The opening's plane x = 10.5 lies a quarter of the width right of the middle; it is 1 m, 100 pixels, high.
  const auto at = [&](int row, int column) { return values[static_cast<std::size_t>(row * 400 + column)]; };
  EXPECT_NEAR(at(199, 250), 0.5f, 0.02f);
  EXPECT_GT(at(155, 250), 0.0f);
  EXPECT_LT(at(145, 250), 0.0f);
  EXPECT_GT(at(245, 250), 0.0f);
  EXPECT_LT(at(255, 250), 0.0f);
  EXPECT_EQ(plane.pixel(X_WG.translation()), cv::Point(250, 200));
}

TEST(Map, ZeroLineFollowsTheSign) {
  MapPlane plane;
  plane.size_px = 100;
  std::vector<float> values(100 * 100, 1.0f);
  cv::Mat map = draw_map(plane, values);
  draw_zero_line(&map, plane, values, cv::Scalar(0, 0, 0));
  EXPECT_EQ(pixels_like(map, cv::Vec3b(0, 0, 0)), 0);
  for (int row = 0; row < 100; ++row)
    for (int column = 50; column < 100; ++column) values[static_cast<std::size_t>(row * 100 + column)] = -1.0f;
  draw_zero_line(&map, plane, values, cv::Scalar(0, 0, 0));
  EXPECT_EQ(map.at<cv::Vec3b>(40, 50), cv::Vec3b(0, 0, 0));
  EXPECT_EQ(map.at<cv::Vec3b>(40, 49), cv::Vec3b(0, 0, 0));
  EXPECT_NE(map.at<cv::Vec3b>(40, 48), cv::Vec3b(0, 0, 0));
  EXPECT_NE(map.at<cv::Vec3b>(40, 51), cv::Vec3b(0, 0, 0));
}

TEST(Depth, NearIsLightAndNothingIsBlack) {
  View view{default_camera()};
  view.scale = 2;
  std::vector<float> depth_m(static_cast<std::size_t>(view.camera.width_px * view.camera.height_px), 8.0f);
  depth_m[0] = 0.0f;
  depth_m[1] = 1.0f;
  const cv::Mat picture = draw_depth(view, depth_m);
  EXPECT_EQ(picture.at<cv::Vec3b>(1, 1), cv::Vec3b(0, 0, 0));
  EXPECT_GT(picture.at<cv::Vec3b>(0, 2)[0], picture.at<cv::Vec3b>(0, 4)[0]);
}

TEST(Outline, StandsWhereTheGateIsSeenAndNotBehindTheCamera) {
  View view{default_camera(), forward_camera_mount(0.0)};
  const cv::Vec3b blue(200, 60, 30);
  const std::vector<float> nothing(static_cast<std::size_t>(view.camera.width_px * view.camera.height_px), 0.0f);
  Isometry3d X_WG = Isometry3d::Identity();
  X_WG.translation() = Vector3d(3.0, 0.0, 0.0);
  cv::Mat picture = draw_depth(view, nothing);
  draw_outline(&picture, view, X_WG, 0.5, kTruth);
  EXPECT_GT(pixels_like(picture, blue), 100);
  const cv::Point corner = view.pixel(X_WG * Vector3d(0.0, 0.5, 0.5));
  EXPECT_EQ(picture.at<cv::Vec3b>(corner), blue);
  EXPECT_LT(corner.x, picture.cols / 2) << "left of the gate is left in the picture";
  EXPECT_LT(corner.y, picture.rows / 2);

  X_WG.translation().x() = -3.0;
  picture = draw_depth(view, nothing);
  draw_outline(&picture, view, X_WG, 0.5, kTruth);
  EXPECT_EQ(pixels_like(picture, blue), 0);
}

}  // namespace
}  // namespace gatefield::tools
