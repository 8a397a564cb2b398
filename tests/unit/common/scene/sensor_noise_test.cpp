#include "common/scene/sensor_noise.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <functional>

namespace gatefield::scene {
namespace {

DepthImage plane(float z_m) {
  DepthImage image{160, 90, std::vector<float>(160 * 90, z_m)};
  return image;
}

SurfaceImage surface_of(float cosine, float reflectance) {
  return {std::vector<float>(160 * 90, cosine), std::vector<float>(160 * 90, reflectance)};
}

/// Everything off; tests switch on what they look at.
SensorNoise silent() {
  SensorNoise noise;
  noise.disparity_noise_px = noise.disparity_step_px = 0;
  noise.bleed_probability = noise.shadow_probability = 0;
  noise.hole_rate_per_image = noise.speckle_probability = 0;
  noise.incidence_loss = noise.reflectance_loss = 0;
  return noise;
}

struct Statistics {
  double mean = 0.0;
  double sigma = 0.0;
  double valid = 0.0;  ///< part of the pixels
};

Statistics measure(const SensorNoise& noise, const DepthImage& clean, const SurfaceImage& surface, int images = 4) {
  Random random(11);
  DepthImage noisy;
  double sum = 0.0;
  double squares = 0.0;
  double count = 0.0;
  double total = 0.0;
  for (int i = 0; i < images; ++i) {
    apply_noise(noise, default_camera(), clean, surface, &random, &noisy);
    for (const float z : noisy.depth_m) {
      ++total;
      if (z == 0.0f) continue;
      ++count;
      sum += z;
      squares += static_cast<double>(z) * z;
    }
  }
  const double mean = sum / count;
  return {mean, std::sqrt(std::max(squares / count - mean * mean, 0.0)), count / total};
}

TEST(SensorNoise, ScaleZeroIsTheIdealCamera) {
  SensorNoise noise;
  noise.scale = 0.0;
  Random random(1);
  DepthImage clean = plane(3.3f);
  clean.depth_m[5] = 0.0f;
  DepthImage noisy;
  apply_noise(noise, default_camera(), clean, surface_of(0.2f, 0.1f), &random, &noisy);
  EXPECT_EQ(noisy.depth_m, clean.depth_m);
  EXPECT_EQ(noisy.width_px, 160);
  EXPECT_EQ(noisy.height_px, 90);
}

TEST(SensorNoise, SigmaOfDepthGrowsWithItsSquare) {
  SensorNoise noise = silent();
  noise.disparity_noise_px = 0.02;  // small: the map from disparity to depth is nearly straight
  const double fx_b = default_camera().fx_px * noise.baseline_m;
  for (const float z_m : {1.0f, 2.0f, 4.0f}) {
    const Statistics statistics = measure(noise, plane(z_m), surface_of(1, 1));
    EXPECT_EQ(statistics.valid, 1.0);
    EXPECT_NEAR(statistics.sigma, z_m * z_m / fx_b * 0.02, 0.03 * z_m * z_m / fx_b * 0.02) << z_m;
    EXPECT_NEAR(statistics.mean, z_m, 0.002 * z_m) << z_m;
  }
}

TEST(SensorNoise, ScaleMultipliesTheNoise) {
  SensorNoise noise = silent();
  noise.disparity_noise_px = 0.02;
  const double once = measure(noise, plane(2.0f), surface_of(1, 1)).sigma;
  noise.scale = 2.0;
  EXPECT_NEAR(measure(noise, plane(2.0f), surface_of(1, 1)).sigma, 2.0 * once, 0.03 * once);
}

TEST(SensorNoise, DisparityComesInSteps) {
  SensorNoise noise = silent();
  noise.disparity_step_px = 0.25;
  const double fx_b = default_camera().fx_px * noise.baseline_m;
  Random random(1);
  DepthImage noisy;
  apply_noise(noise, default_camera(), plane(2.9f), surface_of(1, 1), &random, &noisy);
  const double steps = fx_b / noisy.depth_m.front() / 0.25;
  EXPECT_NEAR(steps, std::round(fx_b / 2.9 / 0.25), 1e-4);
}

TEST(SensorNoise, GrazingAndBlackSurfacesLosePixels) {
  SensorNoise noise = silent();
  noise.incidence_loss = 0.6;
  noise.reflectance_loss = 0.5;
  EXPECT_EQ(measure(noise, plane(2), surface_of(1, 1)).valid, 1.0);
  EXPECT_NEAR(measure(noise, plane(2), surface_of(0, 1)).valid, 0.4, 0.01);
  EXPECT_NEAR(measure(noise, plane(2), surface_of(1, 0)).valid, 0.5, 0.01);
  EXPECT_NEAR(measure(noise, plane(2), surface_of(0, 0)).valid, 0.2, 0.01);
  EXPECT_NEAR(measure(noise, plane(2), surface_of(0.5f, 1)).valid, 1.0 - 0.6 / 8.0, 0.01);
}

TEST(SensorNoise, SpeckleIsAsFrequentAsSaidAndInRange) {
  SensorNoise noise = silent();
  noise.speckle_probability = 0.05;
  Random random(5);
  DepthImage noisy;
  apply_noise(noise, default_camera(), plane(2), surface_of(1, 1), &random, &noisy);
  int wrong = 0;
  double sum = 0.0;
  for (const float z : noisy.depth_m) {
    ASSERT_GE(z, 0.3f);
    ASSERT_LE(z, 10.0f);
    // Without any disparity noise all others are what they were, up to the steps of single precision.
    if (std::abs(z - 2.0f) > 1e-3f) {
      ++wrong;
      sum += z;
    }
  }
  EXPECT_NEAR(wrong / 14400.0, 0.05, 0.01);
  EXPECT_NEAR(sum / wrong, 5.15, 0.4);  // uniform over the range
}

TEST(SensorNoise, HolesComeAtTheirRateAndSize) {
  SensorNoise noise = silent();
  noise.hole_rate_per_image = 3.0;
  noise.hole_radius_px = 4.0;
  // Radius uniform in 0.4 to 1.6 of the mean: E[r^2] = 1.12 mean^2; a little is cut off at the borders or overlaps.
  const double expected = 3.0 * 3.14159 * 16.0 * 1.12 / 14400.0;
  EXPECT_NEAR(1.0 - measure(noise, plane(2), surface_of(1, 1), 300).valid, expected, 0.15 * expected);
}

/// Left half (of the columns before `edge_px`) far, the rest near.
DepthImage step_image(int edge_px, float left_m, float right_m) {
  DepthImage image = plane(right_m);
  for (int v = 0; v < 90; ++v) {
    for (int u = 0; u < edge_px; ++u) image.depth_m[static_cast<std::size_t>(v * 160 + u)] = left_m;
  }
  return image;
}

TEST(SensorNoise, ShadowLiesLeftOfNearThingsAndIsAsWideAsTheDisparityStep) {
  SensorNoise noise = silent();
  noise.shadow_probability = 1.0;
  noise.baseline_m = 0.2;
  const double step_px = default_camera().fx_px * noise.baseline_m * (1.0 / 1.0 - 1.0 / 4.0);  // 12.6 px
  Random random(1);
  DepthImage noisy;
  apply_noise(noise, default_camera(), step_image(80, 4.0f, 1.0f), surface_of(1, 1), &random, &noisy);
  for (int u = 0; u < 160; ++u) {
    const bool shadow = u < 80 && u >= 80 - step_px;
    EXPECT_EQ(noisy.depth_m[static_cast<std::size_t>(45 * 160 + u)] == 0.0f, shadow) << u;
  }
  // The other way round nothing is hidden from the second imager.
  apply_noise(noise, default_camera(), step_image(80, 1.0f, 4.0f), surface_of(1, 1), &random, &noisy);
  EXPECT_THAT(noisy.depth_m, testing::Each(testing::Gt(0.0f)));
}

TEST(SensorNoise, BleedingStaysAtTheEdgeAndBetweenTheTwoDepths) {
  SensorNoise noise = silent();
  noise.bleed_probability = 0.35;
  Random random(3);
  DepthImage noisy;
  int changed = 0;
  for (int image = 0; image < 20; ++image) {
    apply_noise(noise, default_camera(), step_image(80, 4.0f, 2.0f), surface_of(1, 1), &random, &noisy);
    for (int v = 0; v < 90; ++v) {
      for (int u = 0; u < 160; ++u) {
        const float z = noisy.depth_m[static_cast<std::size_t>(v * 160 + u)];
        const float clean = u < 80 ? 4.0f : 2.0f;
        ASSERT_GE(z, 2.0f - 1e-3f);
        ASSERT_LE(z, 4.0f + 1e-3f);
        if (u != 79 && u != 80) {
          ASSERT_NEAR(z, clean, 1e-3f) << u;
        } else if (std::abs(z - clean) > 0.01f) {
          ++changed;
        }
      }
    }
  }
  EXPECT_NEAR(changed / (20.0 * 90 * 2), 0.35, 0.04);
}

TEST(SensorNoise, SameStreamGivesTheSameImageAndTheNextOneDiffers) {
  const DepthImage clean = step_image(60, 6.0f, 2.5f);
  const SurfaceImage surface = surface_of(0.8f, 0.6f);
  DepthImage first;
  DepthImage second;
  DepthImage other;
  Random a(9, 4);
  Random b(9, 4);
  apply_noise({}, default_camera(), clean, surface, &a, &first);
  apply_noise({}, default_camera(), clean, surface, &b, &second);
  EXPECT_EQ(first.depth_m, second.depth_m);
  EXPECT_EQ(a.bits(), b.bits());
  apply_noise({}, default_camera(), clean, surface, &a, &other);
  EXPECT_NE(first.depth_m, other.depth_m);
}

TEST(SensorNoise, InvalidStaysZeroAndTheRestStaysInRange) {
  DepthImage clean = plane(0.0f);
  Random world(7);
  for (float& z : clean.depth_m) {
    if (!world.chance(0.3)) z = static_cast<float>(world.uniform(0.3, 10.0));
  }
  SensorNoise noise;
  noise.scale = 3.0;
  noise.speckle_probability = 0.2;
  Random random(1);
  DepthImage noisy;
  for (int i = 0; i < 20; ++i) {
    apply_noise(noise, default_camera(), clean, surface_of(0.7f, 0.7f), &random, &noisy);
    for (std::size_t k = 0; k < noisy.depth_m.size(); ++k) {
      const float z = noisy.depth_m[k];
      ASSERT_TRUE(z == 0.0f || (z >= 0.3f && z <= 10.0f)) << z;
      ASSERT_TRUE(clean.depth_m[k] > 0.0f || z == 0.0f);
    }
  }
}

TEST(SensorNoise, WorksOnOddSizes) {
  CameraModel camera = camera_from_fov(37, 23, 1.2, 0.8);
  DepthImage clean{37, 23, std::vector<float>(37 * 23, 2.0f)};
  const SurfaceImage surface{std::vector<float>(37 * 23, 1.0f), std::vector<float>(37 * 23, 1.0f)};
  Random random(1);
  DepthImage noisy;
  apply_noise({}, camera, clean, surface, &random, &noisy);
  EXPECT_EQ(noisy.depth_m.size(), 37u * 23u);
}

TEST(SensorNoise, ValidationNamesTheField) {
  EXPECT_TRUE(validate(SensorNoise{}).ok());
  const auto error_of = [](const std::function<void(SensorNoise&)>& spoil) {
    SensorNoise noise;
    spoil(noise);
    return validate(noise).error();
  };
  using testing::HasSubstr;
  EXPECT_THAT(error_of([](SensorNoise& n) { n.baseline_m = 0; }), HasSubstr("noise.baseline_m"));
  EXPECT_THAT(error_of([](SensorNoise& n) { n.disparity_noise_px = -1; }), HasSubstr("noise.disparity_noise_px"));
  EXPECT_THAT(error_of([](SensorNoise& n) { n.disparity_step_px = NAN; }), HasSubstr("noise.disparity_step_px"));
  EXPECT_THAT(error_of([](SensorNoise& n) { n.bleed_probability = 1.1; }), HasSubstr("noise.bleed_probability"));
  EXPECT_THAT(error_of([](SensorNoise& n) { n.hole_radius_px = -1; }), HasSubstr("noise.hole_radius_px"));
  EXPECT_THAT(error_of([](SensorNoise& n) { n.scale = INFINITY; }), HasSubstr("noise.scale"));
}

TEST(SensorNoise, TheFirstModelStaysWhatItIs) {
  // Published flights and shipped models were made with these bits.
  DepthImage clean = plane(1.0f);
  SurfaceImage surface = surface_of(1, 1);
  for (int i = 0; i < 160 * 90; ++i) {
    const int column = i % 160, row = i / 160;
    const auto u = static_cast<float>(column), v = static_cast<float>(row);
    const auto k = static_cast<std::size_t>(i);
    clean.depth_m[k] = (u > 40 && u < 70 && v > 20) ? 1.5f : (v > 60 ? 0.02f * u + 1.0f : 6.0f + 0.01f * v);
    surface.cos_incidence[k] = 0.1f + 0.9f * u / 160;
    surface.reflectance[k] = 0.2f + 0.8f * v / 90;
  }
  Random random(17);
  DepthImage noisy;
  std::uint64_t hash = 0xcbf29ce484222325ull;
  for (int image = 0; image < 3; ++image) {
    SensorNoise noise;
    noise.scale = 0.5 + 0.5 * image;
    apply_noise(noise, default_camera(), clean, surface, &random, &noisy);
    for (const float z : noisy.depth_m) hash = (hash ^ std::bit_cast<std::uint32_t>(z)) * 0x100000001b3ull;
  }
  EXPECT_EQ(hash, 0x05d9199b621e16bfull);
  EXPECT_EQ(random.bits(), 0x8fe78ab5u);
}

}  // namespace
}  // namespace gatefield::scene
