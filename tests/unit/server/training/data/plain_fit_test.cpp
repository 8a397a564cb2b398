#include "server/training/data/plain_fit.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>

#include "server/training/data/cloud_fit.h"
#include "server/training/data/surface_estimate.h"
#include "tests/unit/server/training/data/frame_folder.h"

namespace gatefield::training {
namespace {

using testing::HasSubstr;
constexpr int kWidth = 320, kHeight = 240;

/// As the 25 real frames: half the sensor's resolution.
SensorGeometry half_sensor() {
  SensorGeometry geometry;
  geometry.camera.width_px = kWidth;
  geometry.camera.height_px = kHeight;
  geometry.camera.fx_px = geometry.camera.fy_px = 191.5;
  geometry.camera.cx_px = 160.0;
  geometry.camera.cy_px = 120.0;
  geometry.focal_px = 383.0;
  geometry.baseline_m = 0.05;
  return geometry;
}

/// A wall at `far_m` behind pillars at `near_m`, 5 % nearer at the bottom.
std::vector<float> pillars(float near_m, float far_m) {
  std::vector<float> depth_m;
  for (int v = 0; v < kHeight; ++v)
    for (int u = 0; u < kWidth; ++u) {
      const bool pillar = (u > 90 && u < 130) || (u > 200 && u < 280 && v > 60);
      depth_m.push_back((pillar ? near_m : far_m) * (1.0f - 0.05f * static_cast<float>(v) / kHeight));
    }
  return depth_m;
}

std::vector<std::vector<float>> drawn(const scene::ActiveStereoNoise& noise, int count) {
  const SensorGeometry geometry = half_sensor();
  CameraModel wide = geometry.camera;
  wide.min_depth_m = 0.05;
  wide.max_depth_m = 100.0;
  std::vector<std::vector<float>> frames;
  for (int i = 0; i < count; ++i) {
    const float near_m = i % 2 == 0 ? 1.5f : 0.9f, far_m = i % 2 == 0 ? 4.0f : 2.5f;
    const scene::DepthImage clean{kWidth, kHeight, pillars(near_m, far_m)};
    const scene::SurfaceImage surface{std::vector<float>(clean.depth_m.size(), 1.0f),
                                      std::vector<float>(clean.depth_m.size(), 0.55f)};
    scene::DepthImage noisy;
    scene::apply_active_stereo(noise, 1.0, wide, clean, surface, {static_cast<std::uint32_t>(i), 8}, &noisy);
    frames.push_back(noisy.depth_m);
  }
  return frames;
}

class PlainFitTest : public FrameFolderFixture {
 protected:
  PlainFit fit_of(const scene::ActiveStereoNoise& noise, int count) {
    put_camera(kWidth, kHeight, 191.5);
    const auto frames = drawn(noise, count);
    for (std::size_t i = 0; i < frames.size(); ++i)
      put_png("frame-" + std::to_string(100 + i) + ".png", kWidth, kHeight, frames[i]);
    const auto found = find_frames({folder_});
    EXPECT_TRUE(found.ok()) << found.error();
    auto fit = fit_plain(*found, {.decimation = 2.0, .baseline_m = 0.05});
    EXPECT_TRUE(fit.ok()) << fit.error();
    return std::move(fit).value();
  }
};

scene::ActiveStereoNoise known() {
  scene::ActiveStereoNoise noise;
  noise.gain_min = noise.gain_max = 1.0;
  noise.depth_scale_min = noise.depth_scale_max = 1.0;
  noise.row_loss_rate = 0.0;
  return noise;
}

TEST_F(PlainFitTest, GivesKnownNoiseBack) {
  const scene::ActiveStereoNoise truth = known();
  const PlainFit fit = fit_of(truth, 12);
  const scene::ActiveStereoNoise& found = *fit.noise.active_stereo;
  ASSERT_GE(found.clouds.size(), 2u);
  for (const auto& cloud : found.clouds) {
    const auto expected = scene::cloud_at(truth, cloud.at_m);
    const double expected_px = std::hypot(expected.small_px, expected.large_px);
    EXPECT_NEAR(std::hypot(cloud.small_px, cloud.large_px), expected_px, 0.3 * expected_px) << cloud.at_m << " m";
  }
  EXPECT_LT(found.gain_max / found.gain_min, 2.0);
  EXPECT_NEAR(found.band_px, truth.band_px, 1.5);
  EXPECT_NEAR(found.band_sigma_px, truth.band_sigma_px, 0.8);
  EXPECT_NEAR(found.shadow_extra_px, truth.shadow_extra_px, 1.5);
  EXPECT_NEAR(found.right_width_max_px, truth.right_width_max_px, 2.5);
  EXPECT_LT(found.speckle_probability, 0.002);
}

TEST_F(PlainFitTest, LessNoiseIsFoundAsLess) {
  scene::ActiveStereoNoise weak = known();
  for (auto& cloud : weak.clouds) {
    cloud.small_px *= 0.4;
    cloud.large_px *= 0.4;
  }
  weak.band_px = 2.0;
  weak.shadow_extra_px = 6.0;
  const PlainFit fit = fit_of(weak, 8);
  for (const auto& cloud : fit.noise.active_stereo->clouds) {
    const auto expected = scene::cloud_at(weak, cloud.at_m);
    const double expected_px = std::hypot(expected.small_px, expected.large_px);
    EXPECT_NEAR(std::hypot(cloud.small_px, cloud.large_px), expected_px, 0.4 * expected_px + 0.01) << cloud.at_m;
  }
  EXPECT_NEAR(fit.noise.active_stereo->band_px, 2.0, 1.5);
  EXPECT_NEAR(fit.noise.active_stereo->shadow_extra_px, 6.0, 1.5);
}

TEST_F(PlainFitTest, WhatSingleFramesDontTellKeepsItsDefaultAndSaysSo) {
  const PlainFit fit = fit_of(known(), 3);
  for (const char* field : {"depth_scale_min", "fatten_px", "readout_s", "smooth_sigma_px", "row_loss_rate"}) {
    const auto at = std::ranges::find_if(fit.parameters, [&](const auto& p) { return p.field == field; });
    ASSERT_NE(at, fit.parameters.end()) << field;
    EXPECT_FALSE(at->fitted) << field;
    EXPECT_THAT(at->says, HasSubstr("default")) << field;
  }
  EXPECT_EQ(fit.parameters.size(), scene::active_stereo_fields().size());
  EXPECT_THAT(to_markdown(fit), HasSubstr("| 3 to 5 | drawn |"));
}

TEST_F(PlainFitTest, TooFewFramesAreNamed) {
  put_camera(kWidth, kHeight, 191.5);
  put_png("one.png", kWidth, kHeight, pillars(1.0f, 3.0f));
  EXPECT_THAT(fit_plain(*find_frames({folder_}), {}).error(), HasSubstr("1 frames"));
}

TEST(FindStep, FindsTheStepOfWholeDisparitiesAndNoneWithoutOne) {
  scene::ActiveStereoNoise noise = known();
  noise.white_px = 0.1;
  auto frames = drawn(noise, 4);
  for (auto& frame : frames)
    for (float& z : frame) z = std::round(1000.0f * z) / 1000.0f;
  EXPECT_NEAR(find_step(half_sensor(), frames), 1.0 / 32.0, 2e-4);
  noise.step_px = 0.0;
  EXPECT_EQ(find_step(half_sensor(), drawn(noise, 4)), 0.0);
}

TEST(EstimateSurfaces, FillsHolesWithTheFarSideAndTakesSmallErrorsOut) {
  const SensorGeometry geometry = half_sensor();
  const std::vector<float> clean = pillars(1.5f, 4.0f);
  EXPECT_EQ(fill_holes({0, 1, 0, 0, 3, 0}, 6), (std::vector<float>{1, 1, 3, 3, 3, 3}));
  const auto frame = drawn(known(), 1).front();
  const auto estimated = estimate_surfaces(geometry, frame);
  double before = 0.0, after = 0.0, n = 0.0;
  for (std::size_t i = 0; i < clean.size(); ++i) {
    if (frame[i] == 0.0f) continue;
    before += std::abs(static_cast<double>(1.0f / frame[i] - 1.0f / clean[i]));
    after += std::abs(static_cast<double>(1.0f / estimated[i] - 1.0f / clean[i]));
    n += 1.0;
  }
  EXPECT_LT(after, 0.7 * before);
  EXPECT_EQ(std::ranges::count(estimated, 0.0f), 0);
}

TEST(SurfaceCosines, AWallThatIsSeenAslantIsFoundSo) {
  const SensorGeometry geometry = half_sensor();
  // Plane x cos + ... : turned by 60 deg about the vertical, 3 m away along the optical axis.
  std::vector<float> depth_m;
  const Eigen::Vector3d normal(std::sin(M_PI / 3), 0.0, -std::cos(M_PI / 3));
  for (int v = 0; v < kHeight; ++v)
    for (int u = 0; u < kWidth; ++u)
      depth_m.push_back(static_cast<float>(-3.0 * std::cos(M_PI / 3) / normal.dot(geometry.camera.ray_C(u, v))));
  const auto cosines = surface_cosines(geometry, depth_m);
  EXPECT_NEAR(cosines[120 * kWidth + 160], 0.5f, 0.01f);
}

}  // namespace
}  // namespace gatefield::training
