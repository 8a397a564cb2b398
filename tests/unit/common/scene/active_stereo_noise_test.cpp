#include "common/scene/active_stereo_noise.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "common/scene/noise_planes.h"
#include "common/scene/sensor_noise.h"
#include "tests/unit/common/scene/stereo_images.h"

namespace gatefield::scene {
namespace {

using testing::HasSubstr;

/// Covariance of neighbours `lag` pixels apart in a row, over what was measured; the truth is `mean`.
double covariance(const std::vector<float>& d_px, int width, double mean, int lag) {
  double sum = 0.0, n = 0.0;
  for (std::size_t i = 0; i + static_cast<std::size_t>(lag) < d_px.size(); ++i) {
    if (static_cast<int>(i) % width + lag >= width) continue;
    const auto a = static_cast<double>(d_px[i]), b = static_cast<double>(d_px[i + static_cast<std::size_t>(lag)]);
    if (a == 0.0 || b == 0.0) continue;
    sum += (a - mean) * (b - mean);
    n += 1.0;
  }
  return sum / n;
}

TEST(NoiseField, HasUnitVarianceAndTheCorrelationOfItsBlur) {
  for (const double sigma_px : {0.0, 1.0, 4.5, 10.0}) {
    std::vector<double> sums(5, 0.0);
    for (std::uint32_t image = 0; image < 6; ++image) {
      std::vector<float> field;
      draw_field({image, 3}, 2, 640, 480, sigma_px, &field);
      ASSERT_EQ(field.size(), 640u * 480u);
      for (int k = 0; k < 5; ++k) sums[static_cast<std::size_t>(k)] += covariance(field, 640, 0.0, 5 * k) / 6.0;
    }
    EXPECT_NEAR(sums[0], 1.0, 0.06) << sigma_px;
    for (int k = 1; k < 5; ++k) {
      const double expected = sigma_px > 0.0 ? std::exp(-25.0 * k * k / (4.0 * sigma_px * sigma_px)) : 0.0;
      EXPECT_NEAR(sums[static_cast<std::size_t>(k)], expected, 0.06) << sigma_px << " px, lag " << 5 * k;
    }
  }
}

TEST(ActiveStereo, CloudsGrowWithDistance) {
  const CameraModel camera = sensor_camera();
  ActiveStereoNoise noise = silent();
  noise.clouds = ActiveStereoNoise{}.clouds;
  double before_m = 0.0;
  for (const double z_m : {1.0, 2.0, 3.0, 4.0, 6.0, 10.0}) {
    const double d = kFocalBaseline / z_m;
    const DepthImage clean = image_of(camera, [&](int, int) { return d; });
    double variance = 0.0;
    for (std::uint32_t image = 0; image < 6; ++image)
      variance += covariance(disparities(noise, camera, clean, image), 640, d, 0) / 6.0;
    const ActiveStereoNoise::Cloud cloud = cloud_at(noise, z_m);
    const double expected_px = std::hypot(cloud.small_px, cloud.large_px);
    EXPECT_NEAR(std::sqrt(variance), expected_px, 0.08 * expected_px) << z_m;
    const double error_m = std::sqrt(variance) * z_m * z_m / kFocalBaseline;
    EXPECT_GT(error_m, 1.5 * before_m) << z_m;
    before_m = error_m;
  }
}

TEST(ActiveStereo, CloudsBetweenTwoDistancesLieBetween) {
  ActiveStereoNoise noise;
  noise.clouds = {{1.0, 0.1, 0.2}, {3.0, 0.3, 0.6}};
  EXPECT_DOUBLE_EQ(cloud_at(noise, 0.5).small_px, 0.1);
  EXPECT_DOUBLE_EQ(cloud_at(noise, 2.0).small_px, 0.2);
  EXPECT_DOUBLE_EQ(cloud_at(noise, 2.0).large_px, 0.4);
  EXPECT_DOUBLE_EQ(cloud_at(noise, 30.0).large_px, 0.6);
}

TEST(ActiveStereo, BlobsHaveTheirSizeInImagesOfAnyResolution) {
  // At a distance r the error's correlation is a1^2 exp(-r^2 / (4 r1^2)) + a2^2 exp(-r^2 / (4 r2^2)), r in sensor
  // pixels.
  ActiveStereoNoise noise = silent();
  noise.clouds = {{4.0, 0.15, 0.30}};
  for (const int decimation : {1, 4}) {
    CameraModel camera = sensor_camera(640 / decimation, 480 / decimation);
    camera.fx_px = camera.fy_px = 383.0 / decimation;
    const double d = kFocalBaseline / 4.0;
    const DepthImage clean = image_of(camera, [&](int, int) { return d; });
    std::vector<double> sums(4, 0.0);
    for (std::uint32_t image = 0; image < 12; ++image) {
      const auto drawn = disparities(noise, camera, clean, image);
      for (int k = 0; k < 4; ++k)
        sums[static_cast<std::size_t>(k)] += covariance(drawn, camera.width_px, d, 8 * k / decimation) / 12.0;
    }
    for (int k = 1; k < 4; ++k) {
      const double r_px = 8.0 * k;
      const double expected =
          (0.0225 * std::exp(-r_px * r_px / 81.0) + 0.09 * std::exp(-r_px * r_px / 400.0)) / (0.0225 + 0.09);
      EXPECT_NEAR(sums[static_cast<std::size_t>(k)] / sums[0], expected, 0.06) << r_px << ", decimated " << decimation;
    }
  }
}

TEST(ActiveStereo, EachImageHasItsGain) {
  const CameraModel camera = sensor_camera();
  ActiveStereoNoise noise = silent();
  noise.clouds = {{1.0, 0.1, 0.0}};
  noise.gain_min = 0.5;
  noise.gain_max = 2.0;
  const DepthImage clean = image_of(camera, [](int, int) { return 10.0; });
  std::vector<double> gains;
  for (std::uint32_t image = 0; image < 40; ++image)
    gains.push_back(std::sqrt(covariance(disparities(noise, camera, clean, image), 640, 10.0, 0)) / 0.1);
  std::ranges::sort(gains);
  EXPECT_GT(gains.front(), 0.45);
  EXPECT_LT(gains.front(), 0.65);
  EXPECT_NEAR(gains[20], 1.0, 0.3);
  EXPECT_GT(gains.back(), 1.6);
  EXPECT_LT(gains.back(), 2.2);
  // And so the scale: half of it.
  EXPECT_NEAR(std::sqrt(covariance(disparities(noise, camera, clean, 3, 0.5), 640, 10.0, 0)),
              0.5 * std::sqrt(covariance(disparities(noise, camera, clean, 3), 640, 10.0, 0)), 2e-3);
}

TEST(ActiveStereo, DisparitiesAreWholeSteps) {
  ActiveStereoNoise noise = silent();
  noise.white_px = 0.3;
  noise.step_px = 1.0 / 32.0;
  const CameraModel camera = sensor_camera(160, 120);
  for (const float d : disparities(noise, camera, image_of(camera, [](int, int) { return 7.7; })))
    EXPECT_NEAR(32.0f * d, std::round(32.0f * d), 2e-3f);
}

TEST(ActiveStereo, SmallJumpsBecomeRampsAndLargeOnesStay) {
  ActiveStereoNoise noise = silent();
  noise.smooth_below_px = 2.0;
  const CameraModel camera = sensor_camera();
  const auto row_of = [&](double jump_px) {
    auto d = disparities(noise, camera, image_of(camera, [&](int u, int) { return u < 320 ? 8.0 : 8.0 + jump_px; }));
    return std::vector<float>(d.begin() + 240 * 640, d.begin() + 241 * 640);
  };
  const auto rise_px = [](const std::vector<float>& row, double jump_px) {
    return std::ranges::count_if(row, [&](float d) { return d > 8.0 + 0.1 * jump_px && d < 8.0 + 0.9 * jump_px; });
  };
  EXPECT_NEAR(static_cast<double>(rise_px(row_of(1.5), 1.5)), 11.0, 2.0);
  EXPECT_EQ(rise_px(row_of(3.0), 3.0), 0);
}

TEST(ActiveStereo, WhatLiesBeyondTheRangeComesIntoIt) {
  ActiveStereoNoise noise = silent();
  noise.clouds = {{1.0, 0.2, 0.45}};
  CameraModel camera = sensor_camera();
  camera.max_depth_m = 10.0;
  const DepthImage clean = image_of(camera, [](int, int) { return kFocalBaseline / 12.0; });
  double there = 0.0, changes = 0.0;
  for (std::uint32_t image = 0; image < 8; ++image) {
    DepthImage noisy;
    apply_active_stereo(noise, 1.0, camera, clean, surface_of(clean), {image, 5}, &noisy);
    for (std::size_t i = 1; i < noisy.depth_m.size(); ++i) {
      there += noisy.depth_m[i] > 0.0f ? 1.0 : 0.0;
      changes += (noisy.depth_m[i] > 0.0f) != (noisy.depth_m[i - 1] > 0.0f) ? 1.0 : 0.0;
    }
  }
  // 0.32 px nearer than it is: 0.65 sigma, a quarter of the image. In blobs: neighbours mostly agree.
  EXPECT_NEAR(there / (8.0 * 640.0 * 480.0), 0.26, 0.04);
  EXPECT_LT(changes / (8.0 * 640.0 * 480.0), 0.08);  // 0.38 if pixels were independent
}

TEST(ActiveStereo, TheDepthIsScaled) {
  ActiveStereoNoise noise = silent();
  noise.depth_scale_min = noise.depth_scale_max = 1.03;
  const CameraModel camera = sensor_camera(64, 64);
  const DepthImage clean = image_of(camera, [](int, int) { return 10.0; });
  DepthImage noisy;
  apply_active_stereo(noise, 1.0, camera, clean, surface_of(clean), {1, 1}, &noisy);
  EXPECT_NEAR(noisy.depth_m[2000], 1.03f * clean.depth_m[2000], 1e-4f);
}

TEST(ActiveStereo, RowsRollWhileTheCameraTurns) {
  ActiveStereoNoise noise = silent();
  noise.readout_s = 0.02;
  noise.turn_rad_s = 10.0;
  const CameraModel camera = sensor_camera(400, 200);
  const DepthImage clean = image_of(camera, [](int u, int) { return u < 200 ? 10.0 : 10.4; });
  double most = 0.0;
  for (std::uint32_t image = 0; image < 20; ++image) {
    const auto d = disparities(noise, camera, clean, image);
    const auto edge = [&](int v) {
      int u = 200;
      while (u > 0 && d[static_cast<std::size_t>(v) * 400 + u] > 10.2f) --u;
      while (u < 399 && d[static_cast<std::size_t>(v) * 400 + u] < 10.2f) ++u;
      return u;
    };
    EXPECT_NEAR(edge(100), 200, 2);                               // the middle row is the image's time
    EXPECT_NEAR(edge(60) - edge(100), edge(100) - edge(140), 4);  // the others lean by as much either way
    most = std::max(most, std::abs(static_cast<double>(edge(60) - edge(140))));
  }
  EXPECT_GT(most, 20.0);
  EXPECT_LE(most, 0.4 * 0.02 * 10.0 * 383.0 + 2.0);
}

TEST(ActiveStereo, TheKeyNamesTheImage) {
  const CameraModel camera = default_camera();
  const DepthImage clean = image_of(camera, [](int u, int) { return u < 80 ? 12.0 : 5.0; });
  const ActiveStereoNoise noise;
  EXPECT_EQ(disparities(noise, camera, clean, 1), disparities(noise, camera, clean, 1));
  EXPECT_NE(disparities(noise, camera, clean, 1), disparities(noise, camera, clean, 2));
}

TEST(ActiveStereo, IsTheSensorsNoiseWhenSet) {
  SensorNoise noise;
  noise.active_stereo.emplace();
  const CameraModel camera = default_camera();
  const DepthImage clean = image_of(camera, [](int, int) { return 8.0; });
  DepthImage by_model, by_noise;
  Random random(9), same(9);
  const std::array<std::uint32_t, 2> key{same.bits(), same.bits()};
  apply_active_stereo(*noise.active_stereo, 1.0, camera, clean, surface_of(clean), key, &by_model);
  apply_noise(noise, camera, clean, surface_of(clean), &random, &by_noise);
  EXPECT_EQ(by_noise.depth_m, by_model.depth_m);
  EXPECT_EQ(random.bits(), same.bits());  // as many numbers as the first model takes
  EXPECT_DOUBLE_EQ(rendered_camera(noise, camera).max_depth_m, 25.0);
  EXPECT_DOUBLE_EQ(rendered_camera({}, camera).max_depth_m, 10.0);
}

TEST(ActiveStereo, OneSensorHasOneScale) {
  SensorNoise noise;
  noise.active_stereo.emplace();
  const auto scale_of = [&](std::uint64_t seed) {
    const SensorNoise one = one_sensor(noise, seed);
    EXPECT_EQ(one.active_stereo->depth_scale_min, one.active_stereo->depth_scale_max);
    return one.active_stereo->depth_scale_min;
  };
  EXPECT_EQ(scale_of(1), scale_of(1));
  EXPECT_NE(scale_of(1), scale_of(2));
  EXPECT_NEAR(scale_of(1), 1.0, 0.03);
}

TEST(ActiveStereo, EveryFieldHasARangeThatIsHeld) {
  EXPECT_TRUE(validate(ActiveStereoNoise{}).ok());
  for (const ActiveStereoField& field : active_stereo_fields()) {
    ActiveStereoNoise noise;
    noise.*field.value = 1.1 * field.high + 1.0;
    const Status status = validate(noise);
    ASSERT_FALSE(status.ok()) << field.name;
    EXPECT_EQ(status.failure().field, std::string("noise.active_stereo.") + field.name);
    noise.*field.value = std::nan("");
    EXPECT_FALSE(validate(noise).ok()) << field.name;
    EXPECT_NE(std::string(field.source), "");
  }
}

TEST(ActiveStereo, LeastIsNotMoreThanMostAndDistancesAscend) {
  ActiveStereoNoise noise;
  noise.gain_min = 3.0;
  EXPECT_THAT(validate(noise).error(), HasSubstr("gain_max"));
  noise = {};
  noise.clouds = {{2.0, 0.1, 0.1}, {2.0, 0.1, 0.1}};
  EXPECT_THAT(validate(noise).error(), HasSubstr("cloud[1].at_m"));
  noise.clouds = {};
  EXPECT_THAT(validate(noise).error(), HasSubstr("cloud"));
}

}  // namespace
}  // namespace gatefield::scene
