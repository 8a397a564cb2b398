#include "common/model/two_look.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace gatefield::model {
namespace {

std::vector<float> flat_wall(const CameraModel& camera, float depth_m) {
  return std::vector<float>(static_cast<std::size_t>(camera.width_px) * camera.height_px, depth_m);
}

struct Crop {
  CropShape shape;
  std::vector<float> input = std::vector<float>(shape.input_size());
  std::vector<float> context = std::vector<float>(kCropContext);
  int returns = 0;
  float at(int channel, int i, int j) const {
    return input[(static_cast<std::size_t>(channel) * shape.size + static_cast<std::size_t>(j)) * shape.size +
                 static_cast<std::size_t>(i)];
  }
};

Crop cut(const std::vector<float>& depth_m, const Eigen::Vector3d& center_C) {
  Crop crop;
  crop.returns = crop_input(depth_m, default_camera(), crop.shape, center_C, crop.input, crop.context);
  return crop;
}

TEST(LookShape, FillsTheHeightUpToThreeHalvings) {
  const LookShape shape = look_shape(160, 90);
  EXPECT_EQ(shape.width, 80);
  EXPECT_EQ(shape.height, 48);
  EXPECT_EQ(shape.anchor_width(), 40);
  EXPECT_EQ(shape.anchor_height(), 24);
}

TEST(CropRay, SpansTheHalfWidthAtTheCentresDepth) {
  const CropShape shape;
  const Eigen::Vector3d center_C(0.6, -0.3, 4.0);
  const double sample_m = 2.0 * shape.half_width_m / shape.size;
  // The outermost samples lie half a sample inside the window's edge.
  const Eigen::Vector3d corner_C = crop_ray_C(shape, center_C, 0, 0) * center_C.z();
  EXPECT_NEAR(corner_C.x(), center_C.x() - shape.half_width_m + 0.5 * sample_m, 1e-12);
  EXPECT_NEAR(corner_C.y(), center_C.y() - shape.half_width_m + 0.5 * sample_m, 1e-12);
  const Eigen::Vector3d opposite_C = crop_ray_C(shape, center_C, shape.size - 1, shape.size - 1) * center_C.z();
  EXPECT_NEAR(opposite_C.x(), center_C.x() + shape.half_width_m - 0.5 * sample_m, 1e-12);
}

TEST(CropInput, GivesCoordinatesRelativeToTheCentre) {
  const CameraModel camera = default_camera();
  const Eigen::Vector3d center_C(0.4, 0.2, 3.0);
  const Crop crop = cut(flat_wall(camera, 3.5f), center_C);
  EXPECT_EQ(crop.returns, crop.shape.size * crop.shape.size);
  const double pixel_m = 3.5 / camera.fx_px;
  for (const int k : {0, 11, 24, 47}) {
    const Eigen::Vector3d ray = crop_ray_C(crop.shape, center_C, k, k);
    // The wall is farther than the centre, so its points spread in proportion; nearest sampling is off by half a pixel
    // at most.
    EXPECT_NEAR(crop.at(0, k, k), ray.x() * 3.5 - center_C.x(), 0.51 * pixel_m);
    EXPECT_NEAR(crop.at(1, k, k), ray.y() * 3.5 - center_C.y(), 0.51 * pixel_m);
    EXPECT_FLOAT_EQ(crop.at(2, k, k), 0.5f);
    EXPECT_EQ(crop.at(3, k, k), 1.0f);
    EXPECT_EQ(crop.at(4, k, k), 0.0f);
    EXPECT_EQ(crop.at(5, k, k), 0.0f);
    EXPECT_EQ(crop.at(6, k, k), 1.0f);
  }
  EXPECT_FLOAT_EQ(crop.context[0], 0.4f / 3.0f);
  EXPECT_FLOAT_EQ(crop.context[1], 0.2f / 3.0f);
  EXPECT_FLOAT_EQ(crop.context[2], 1.0f / 3.0f);
}

TEST(CropInput, MarksWhatIsNearerAndBehind) {
  const CameraModel camera = default_camera();
  const Crop behind = cut(flat_wall(camera, 9.0f), {0.0, 0.0, 3.0});
  EXPECT_FLOAT_EQ(behind.at(2, 24, 24), kCropReach_m);
  EXPECT_EQ(behind.at(5, 24, 24), 1.0f);
  EXPECT_EQ(behind.at(4, 24, 24), 0.0f);
  const Crop before = cut(flat_wall(camera, 1.0f), {0.0, 0.0, 5.0});
  EXPECT_FLOAT_EQ(before.at(2, 24, 24), -kCropReach_m);
  EXPECT_EQ(before.at(4, 24, 24), 1.0f);
  EXPECT_EQ(before.at(5, 24, 24), 0.0f);
}

TEST(CropInput, TellsOutsideTheImageFromNoReturn) {
  const CameraModel camera = default_camera();
  // At 1 m the window reaches beyond the image (87 x 58 deg see 0.95 x 0.55 m).
  const Crop near = cut(flat_wall(camera, 1.0f), {0.0, 0.0, 1.0});
  EXPECT_EQ(near.at(6, 0, 0), 0.0f);
  EXPECT_EQ(near.at(3, 0, 0), 0.0f);
  EXPECT_EQ(near.at(6, 24, 24), 1.0f);
  EXPECT_LT(near.returns, near.shape.size * near.shape.size);
  const Crop empty = cut(flat_wall(camera, 0.0f), {0.0, 0.0, 1.0});
  EXPECT_EQ(empty.returns, 0);
  EXPECT_EQ(empty.at(6, 24, 24), 1.0f);
  EXPECT_EQ(empty.at(3, 24, 24), 0.0f);
}

TEST(CropDepth, IsTheCleanImageAroundTheCentre) {
  const CameraModel camera = default_camera();
  std::vector<float> relative(24 * 24), weight(24 * 24);
  crop_depth(flat_wall(camera, 3.25f), camera, CropShape{}, {0.0, 0.0, 3.0}, 2, relative, weight);
  EXPECT_THAT(relative, testing::Each(testing::FloatEq(0.25f)));
  EXPECT_THAT(weight, testing::Each(1.0f));
}

TEST(FirstLookInput, BackProjectsAndMarksReturns) {
  const CameraModel camera = default_camera();
  auto depth = flat_wall(camera, 2.0f);
  const int u = 101, v = 37;
  depth[static_cast<std::size_t>(v * camera.width_px + u)] = 0.0f;
  const LookShape shape = look_shape(camera.width_px, camera.height_px);
  std::vector<float> input(shape.input_size()), anchors(shape.anchor_size());
  first_look_input(depth, camera, input, anchors);
  const auto value = [&](int channel, int column, int row) {
    return input[(static_cast<std::size_t>(channel) * shape.height + static_cast<std::size_t>(row)) * shape.width +
                 static_cast<std::size_t>(column)];
  };
  // Pixel (101, 37) is the lower right of its 2 x 2 block: third of the four planes.
  EXPECT_EQ(value(3, u / 2, v / 2), 0.0f);
  EXPECT_EQ(value(7, u / 2, v / 2), 0.0f);
  EXPECT_FLOAT_EQ(value(2, u / 2, v / 2), 0.5f);
  EXPECT_EQ(value(6, u / 2, v / 2), 1.0f);
  // Mean point of a whole block: the ray through its middle.
  EXPECT_NEAR(value(8, 10, 20), (21.0 - camera.cx_px) / camera.fx_px * 2.0 / kLookScale_m, 1e-5);
  EXPECT_NEAR(value(9, 10, 20), (41.0 - camera.cy_px) / camera.fy_px * 2.0 / kLookScale_m, 1e-5);
  EXPECT_NEAR(value(10, 10, 20), 2.0 / kLookScale_m, 1e-6);
  EXPECT_NEAR(value(11, 10, 20), (21.0 - camera.cx_px) / camera.fx_px, 1e-6);
  // The rows that only fill up are empty.
  EXPECT_EQ(value(4, 40, 46), 0.0f);
}

TEST(FirstLookInput, AnchorsAreTheNearestReturns) {
  const CameraModel camera = default_camera();
  auto depth = flat_wall(camera, 6.0f);
  depth[static_cast<std::size_t>(42 * camera.width_px + 82)] = 2.5f;  // block (20, 10)
  const LookShape shape = look_shape(camera.width_px, camera.height_px);
  std::vector<float> input(shape.input_size()), anchors(shape.anchor_size());
  first_look_input(depth, camera, input, anchors);
  const auto plane = static_cast<std::size_t>(shape.anchor_width() * shape.anchor_height());
  const std::size_t at = 10 * static_cast<std::size_t>(shape.anchor_width()) + 20;
  EXPECT_FLOAT_EQ(anchors[2 * plane + at], 2.5f);
  EXPECT_NEAR(anchors[at], (82.5 - camera.cx_px) / camera.fx_px * 2.5, 1e-5);
  EXPECT_FLOAT_EQ(anchors[2 * plane + at + 1], 6.0f);
  EXPECT_EQ(anchors[3 * plane + at], 1.0f);
}

TEST(ResampleNearest, KeepsWhatARayHits) {
  // A camera of twice the resolution sees a step in depth at the middle of the image; the network's sees the same step.
  const CameraModel to = default_camera();
  CameraModel from = camera_from_fov(320, 180, 2.0 * std::atan(0.5 * to.width_px / to.fx_px),
                                     2.0 * std::atan(0.5 * to.height_px / to.fy_px));
  std::vector<float> depth(320 * 180);
  for (std::size_t i = 0; i < depth.size(); ++i) depth[i] = i % 320 < 160 ? 2.0f : 4.0f;
  std::vector<float> out;
  resample_nearest(depth, from, to, &out);
  ASSERT_EQ(out.size(), 160u * 90u);
  EXPECT_EQ(out[45 * 160 + 79], 2.0f);
  EXPECT_EQ(out[45 * 160 + 80], 4.0f);
}

TEST(ResampleNearest, LeavesEmptyWhatTheOtherCameraDoesNotSee) {
  const CameraModel to = default_camera();
  const CameraModel narrow = camera_from_fov(160, 90, 0.8, 0.5);
  std::vector<float> depth(160 * 90, 50.0f);
  std::vector<float> out;
  resample_nearest(depth, narrow, to, &out);
  EXPECT_THAT(out, testing::Each(0.0f)) << "beyond the network's range";
  std::fill(depth.begin(), depth.end(), 3.0f);
  resample_nearest(depth, narrow, to, &out);
  EXPECT_EQ(out[0], 0.0f) << "outside the narrow camera's view";
  EXPECT_EQ(out[45 * 160 + 80], 3.0f);
}

}  // namespace
}  // namespace gatefield::model
