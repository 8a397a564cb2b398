#include "common/scene/stereo_camera.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <thread>

#include "common/scene/texture.h"

namespace gatefield::scene {
namespace {

Eigen::Isometry3d looking_along_x(const Eigen::Vector3d& p_W) { return forward_camera_mount(0.0, p_W); }

/// A wall across the view, and nothing else.
World wall(double x_m, Reflectance reflectance = 0.6f) {
  World world;
  world.has_floor = false;
  Box box;
  box.X_WO.translation() = Eigen::Vector3d(x_m + 0.1, 0, 0);
  box.half_m = Eigen::Vector3d(0.1, 40, 40);
  box.reflectance = reflectance;
  world.boxes.push_back(box);
  return world;
}

/// A texture seed whose first object has a contrast in this range.
std::uint64_t seed_with_contrast(float low, float high) {
  for (std::uint64_t seed = 0;; ++seed) {
    const float contrast = draw_material(seed, 0, 0.6f).contrast;
    if (contrast >= low && contrast <= high) return seed;
  }
}

struct Figures {
  double fill = 0.0;     ///< share of pixels with depth
  double bias_px = 0.0;  ///< mean error of the disparity, imager pixels
  double rms_px = 0.0;
};

Figures measure(double x_m, const StereoOptions& options, std::uint64_t texture_seed) {
  const CameraModel camera = default_camera();
  const StereoCamera stereo(wall(x_m), options, texture_seed);
  Random random(1);
  DepthImage depth;
  stereo.render(camera, looking_along_x({0, 0, 0}), &random, &depth);
  Figures figures;
  double n = 0.0;
  const double scale = options.upsampling * camera.fx_px * options.baseline_m;
  for (const float z_m : depth.depth_m) {
    if (z_m <= 0.0f) continue;
    const double error_px = scale / static_cast<double>(z_m) - scale / x_m;
    figures.bias_px += error_px;
    figures.rms_px += error_px * error_px;
    n += 1.0;
  }
  figures.fill = n / static_cast<double>(depth.depth_m.size());
  figures.bias_px /= n;
  figures.rms_px = std::sqrt(figures.rms_px / n);
  return figures;
}

StereoOptions calibrated() {
  StereoOptions options;
  options.shift_x_px = options.shift_y_px = options.roll_rad = options.focal_error = 0.0;
  return options;
}

TEST(StereoCamera, MeasuresATexturedWallBetweenPixelsToo) {
  const std::uint64_t seed = seed_with_contrast(0.25f, 0.35f);
  for (const double x_m : {1.5, 3.0, 5.06}) {
    const Figures figures = measure(x_m, calibrated(), seed);
    EXPECT_GT(figures.fill, 0.9) << x_m;
    EXPECT_NEAR(figures.bias_px, 0.0, 0.05) << x_m;
    EXPECT_LT(figures.rms_px, 0.2) << x_m;
  }
}

TEST(StereoCamera, WhatCalibrationLeftOverShiftsTheDisparity) {
  const std::uint64_t seed = seed_with_contrast(0.25f, 0.35f);
  StereoOptions options = calibrated();
  const double before = measure(2.0, options, seed).bias_px;
  options.shift_x_px = 0.3;
  EXPECT_NEAR(measure(2.0, options, seed).bias_px - before, 0.3, 0.06);
}

TEST(StereoCamera, NothingIsMatchedOnAWallWithoutTextureButForTheProjectedDots) {
  const std::uint64_t seed = seed_with_contrast(0.006f, 0.008f);
  StereoOptions options = calibrated();
  options.pattern = 0.0;
  EXPECT_LT(measure(1.5, options, seed).fill, 0.3);
  options.pattern = 3.0;
  const Figures lit = measure(1.5, options, seed);
  EXPECT_GT(lit.fill, 0.8);
  EXPECT_NEAR(lit.bias_px, 0.0, 0.1);
}

TEST(StereoCamera, ANearPostHidesPartOfTheWallFromTheRightImager) {
  World world = wall(4.0);
  Box post;
  post.X_WO.translation() = Eigen::Vector3d(1.0, 0, 0);
  post.half_m = Eigen::Vector3d(0.05, 0.1, 2.0);
  world.boxes.push_back(post);
  const CameraModel camera = default_camera();
  const StereoCamera stereo(world, calibrated(), seed_with_contrast(0.25f, 0.35f));
  Random random(1);
  DepthImage depth;
  stereo.render(camera, looking_along_x({0, 0, 0}), &random, &depth);
  int nearer = 0;
  int none_left = 0;
  int none_right = 0;
  for (int v = 20; v < 70; ++v) {
    const float* const row = depth.depth_m.data() + static_cast<std::ptrdiff_t>(v) * camera.width_px;
    for (int u = 76; u < 84; ++u) nearer += row[u] > 0.85f && row[u] < 1.05f ? 1 : 0;
    for (int u = 62; u < 71; ++u) none_left += row[u] == 0.0f ? 1 : 0;
    for (int u = 89; u < 98; ++u) none_right += row[u] == 0.0f ? 1 : 0;
  }
  EXPECT_GT(nearer, 50 * 8 * 0.7);
  EXPECT_GT(none_left, none_right + 20);  // what is beside the post on the left is hidden from the right imager
}

TEST(StereoCamera, SameStreamSameImageOnAnyThreadAndTheNextOneDiffers) {
  const StereoCamera stereo(wall(3.0), {}, 5);
  const CameraModel camera = default_camera();
  DepthImage first;
  DepthImage again;
  DepthImage next;
  Random random(3);
  stereo.render(camera, looking_along_x({0, 0, 0}), &random, &first);
  stereo.render(camera, looking_along_x({0, 0, 0}), &random, &next);
  std::thread([&] {
    Random same(3);
    stereo.render(camera, looking_along_x({0, 0, 0}), &same, &again);
  }).join();
  EXPECT_EQ(first.depth_m, again.depth_m);
  EXPECT_NE(first.depth_m, next.depth_m);
}

TEST(StereoCamera, PicturesShowTheRightImagersViewShifted) {
  StereoOptions options = calibrated();
  options.gain_difference = 0.0;
  options.pattern = 0.0;
  const double z_m = 2.0;
  const CameraModel camera = default_camera();
  const StereoCamera stereo(wall(z_m), options, seed_with_contrast(0.25f, 0.35f));
  Random random(1);
  DepthImage depth;
  StereoPictures pictures;
  stereo.render(camera, looking_along_x({0, 0, 0}), &random, &depth, &pictures);
  ASSERT_EQ(pictures.width_px, 480);
  ASSERT_EQ(pictures.height_px, 270);
  // Mean absolute difference is least at the disparity, 6.3 px.
  const auto difference = [&](int shift_px) {
    double sum = 0.0;
    for (int v = 60; v < 200; ++v) {
      for (int u = 100; u < 400; ++u) {
        const auto i = static_cast<std::size_t>(v * pictures.width_px + u);
        sum += std::abs(static_cast<int>(pictures.left[i]) -
                        static_cast<int>(pictures.right[i - static_cast<std::size_t>(shift_px)]));
      }
    }
    return sum;
  };
  int best = 0;
  for (int shift_px = 1; shift_px < 40; ++shift_px) best = difference(shift_px) < difference(best) ? shift_px : best;
  EXPECT_EQ(best, static_cast<int>(std::lround(3.0 * camera.fx_px * options.baseline_m / z_m)));
}

TEST(StereoCamera, KeepsToTheCamerasRange) {
  CameraModel camera = default_camera();
  camera.max_depth_m = 2.5;
  const StereoCamera stereo(wall(3.0), {}, seed_with_contrast(0.25f, 0.35f));
  Random random(1);
  DepthImage depth;
  stereo.render(camera, looking_along_x({0, 0, 0}), &random, &depth);
  for (const float z_m : depth.depth_m) EXPECT_TRUE(z_m == 0.0f || (z_m >= 0.3f && z_m <= 2.5f)) << z_m;
}

TEST(StereoCamera, ValidationNamesTheField) {
  EXPECT_TRUE(validate(StereoOptions{}).ok());
  const auto error_of = [](const std::function<void(StereoOptions&)>& spoil) {
    StereoOptions options;
    spoil(options);
    return validate(options).error();
  };
  using testing::HasSubstr;
  EXPECT_THAT(error_of([](StereoOptions& o) { o.upsampling = 0; }), HasSubstr("stereo.upsampling"));
  EXPECT_THAT(error_of([](StereoOptions& o) { o.baseline_m = NAN; }), HasSubstr("stereo.baseline_m"));
  EXPECT_THAT(error_of([](StereoOptions& o) { o.block_px = 4; }), HasSubstr("stereo.block_px"));
  EXPECT_THAT(error_of([](StereoOptions& o) { o.min_valid = 10; }), HasSubstr("stereo.min_valid"));
}

TEST(FractalNoise, HasMeanZeroAndUnitDeviationFromNear) {
  TexturePoints points;
  points.resize(200'000);
  Random random(1);
  for (std::size_t i = 0; i < points.size(); ++i) {
    points.s_m[i] = static_cast<float>(random.uniform(-50, 50));
    points.t_m[i] = static_cast<float>(random.uniform(-50, 50));
    points.footprint_m[i] = 1e-4f;
    points.persistence[i] = 0.8f;
    points.seed[i] = 7;
  }
  std::vector<float> value(points.size());
  fractal_noise(points, value);
  double mean = 0.0;
  double square = 0.0;
  for (const float v : value) {
    mean += v;
    square += static_cast<double>(v) * v;
  }
  mean /= static_cast<double>(value.size());
  EXPECT_NEAR(mean, 0.0, 0.03);
  EXPECT_NEAR(std::sqrt(square / static_cast<double>(value.size())), 1.0, 0.04);

  std::fill(points.footprint_m.begin(), points.footprint_m.end(), 10.0f);  // far away: even grey
  fractal_noise(points, value);
  EXPECT_EQ(*std::max_element(value.begin(), value.end()), 0.0f);
}

}  // namespace
}  // namespace gatefield::scene
