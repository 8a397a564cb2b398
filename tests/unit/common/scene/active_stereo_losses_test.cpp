#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "common/scene/active_stereo_noise.h"
#include "tests/unit/common/scene/stereo_images.h"

namespace gatefield::scene {
namespace {

TEST(ActiveStereo, JumpsHaveHolesMoreOftenTheHigherTheyAre) {
  ActiveStereoNoise noise = silent();
  noise.edge_step_px = 2.5;
  noise.edge_slope_px = 0.5;
  noise.ragged_px = 0.0;
  noise.right_width_min_px = noise.right_width_max_px = 1.0;
  const CameraModel camera = sensor_camera(64, 400);
  for (const double jump_px : {1.0, 2.0, 2.5, 3.0, 5.0}) {
    const DepthImage clean = image_of(camera, [&](int u, int) { return u < 32 ? 12.0 + jump_px : 12.0; });
    double holes = 0.0;
    for (std::uint32_t image = 0; image < 10; ++image) {
      const auto d = disparities(noise, camera, clean, image);
      for (int v = 0; v < 400; ++v) holes += d[static_cast<std::size_t>(v) * 64 + 32] == 0.0f ? 1.0 : 0.0;
    }
    EXPECT_NEAR(holes / 4000.0, 1.0 / (1.0 + std::exp((2.5 - jump_px) / 0.5)), 0.03) << jump_px;
  }
}

TEST(ActiveStereo, ASlopeIsNoJump) {
  // A floor that falls away by one pixel of disparity a row, as it does at 160 pixels' width, is seen whole.
  ActiveStereoNoise noise = silent();
  noise.edge_step_px = 2.5;
  const CameraModel camera = sensor_camera(64, 48);  // so that no row is nearer than the camera sees
  const auto d = disparities(noise, camera, image_of(camera, [](int, int v) { return 5.0 + 1.0 * v; }));
  EXPECT_LT(std::ranges::count(d, 0.0f), 64 * 48 / 50);
}

TEST(ActiveStereo, TheGapIsWiderRightOfNearThings) {
  ActiveStereoNoise noise = silent();
  noise.edge_step_px = 0.5;
  noise.edge_slope_px = 0.05;
  const CameraModel camera = sensor_camera(128, 400);
  // Near in the middle, between u = 40 and 80 and all rows.
  const DepthImage clean = image_of(camera, [](int u, int) { return u >= 40 && u < 80 ? 14.0 : 11.0; });
  const auto d = disparities(noise, camera, clean);
  double right = 0.0, longest = 0.0, near = 0.0;
  for (int v = 0; v < 400; ++v) {
    double gap = 0.0;
    for (int u = 80; u < 100; ++u) gap += d[static_cast<std::size_t>(v) * 128 + u] == 0.0f ? 1.0 : 0.0;
    right += gap / 400.0;
    longest = std::max(longest, gap);
    for (int u = 45; u < 80; ++u) near += d[static_cast<std::size_t>(v) * 128 + u] == 0.0f ? 1.0 : 0.0;
  }
  EXPECT_NEAR(right, 4.0, 0.3);  // 2 to 6
  EXPECT_LE(longest, 7.0);
  EXPECT_EQ(near, 0.0);  // the hole lies on the far side
}

TEST(ActiveStereo, TheShadowIsAsLongAsTheJumpAndALittleMore) {
  ActiveStereoNoise noise = silent();
  noise.edge_step_px = 2.5;
  noise.edge_width_min_px = noise.edge_width_max_px = 0.0;
  noise.right_width_min_px = noise.right_width_max_px = 0.0;
  noise.shadow_extra_px = 1.8;
  noise.shadow_sigma_px = 3.0;
  noise.ragged_px = 0.0;
  const CameraModel camera = sensor_camera(128, 400);
  const DepthImage clean = image_of(camera, [](int u, int) { return u >= 64 ? 22.0 : 10.0; });
  std::vector<double> lengths;
  for (std::uint32_t image = 0; image < 5; ++image) {
    const auto d = disparities(noise, camera, clean, image);
    for (int v = 0; v < 400; ++v) {
      double length = 0.0;
      while (d[static_cast<std::size_t>(v) * 128 + static_cast<std::size_t>(63 - length)] == 0.0f) ++length;
      lengths.push_back(length);
    }
  }
  double mean = 0.0, squares = 0.0;
  for (const double length : lengths) mean += length / static_cast<double>(lengths.size());
  for (const double length : lengths)
    squares += (length - mean) * (length - mean) / static_cast<double>(lengths.size());
  EXPECT_NEAR(mean, 12.0 + 1.8, 0.6);
  EXPECT_NEAR(std::sqrt(squares), 3.0, 0.3);
}

TEST(ActiveStereo, NothingIsMeasuredLeftOfTheSecondImagersView) {
  ActiveStereoNoise noise = silent();
  noise.band_px = 6.5;
  noise.band_sigma_px = 2.2;
  const CameraModel camera = sensor_camera(128, 480);
  std::vector<double> edges;
  const auto d = disparities(noise, camera, image_of(camera, [](int, int) { return 12.0; }));
  for (int v = 0; v < 480; ++v) {
    double edge = 0.0;
    while (d[static_cast<std::size_t>(v) * 128 + static_cast<std::size_t>(edge)] == 0.0f) ++edge;
    edges.push_back(edge);
  }
  double mean = 0.0, variance = 0.0, next = 0.0, far = 0.0;
  for (const double edge : edges) mean += edge / 480.0;
  for (std::size_t v = 0; v + 12 < edges.size(); ++v) {
    variance += (edges[v] - mean) * (edges[v] - mean);
    next += (edges[v] - mean) * (edges[v + 1] - mean);
    far += (edges[v] - mean) * (edges[v + 12] - mean);
  }
  EXPECT_NEAR(mean, 12.0 + 6.5, 0.7);
  EXPECT_NEAR(std::sqrt(variance / 468.0), 2.2, 0.35);
  EXPECT_GT(next / variance, 0.7);  // alike over some rows, not over many
  EXPECT_LT(std::abs(far / variance), 0.25);
}

TEST(ActiveStereo, DarkAndSlantingSurfacesLosePatches) {
  ActiveStereoNoise noise = silent();
  noise.patch_loss = 0.02;
  const CameraModel camera = sensor_camera();
  const DepthImage clean = image_of(camera, [](int, int) { return 12.0; });
  const auto lost = [&](float cosine, float reflectance) {
    double holes = 0.0;
    for (std::uint32_t image = 0; image < 12; ++image) {
      DepthImage noisy;
      apply_active_stereo(noise, 1.0, camera, clean, surface_of(clean, cosine, reflectance), {image, 5}, &noisy);
      holes += static_cast<double>(std::ranges::count(noisy.depth_m, 0.0f)) / (12.0 * 640.0 * 480.0);
    }
    return holes;
  };
  EXPECT_EQ(lost(1.0f, 1.0f), 0.0);
  const double black = lost(1.0f, 0.0f);
  EXPECT_NEAR(black, 0.02, 0.006);  // ragged edges add a tenth, overlap takes some
  EXPECT_NEAR(lost(0.0f, 1.0f), 0.02, 0.006);
  EXPECT_NEAR(lost(0.5f, 1.0f), 0.02 / 8.0, 0.002);
}

TEST(ActiveStereo, MostOfTheLostAreaLiesInLargeHoles) {
  ActiveStereoNoise noise = silent();
  noise.patch_loss = 0.02;
  const CameraModel camera = sensor_camera();
  const DepthImage clean = image_of(camera, [](int, int) { return 12.0; });
  DepthImage noisy;
  apply_active_stereo(noise, 1.0, camera, clean, surface_of(clean, 1.0f, 0.0f), {2, 5}, &noisy);
  // Pixels whose four neighbours are missing, too, lie in holes; single ones have none.
  double single = 0.0, holes = 0.0;
  for (int v = 1; v + 1 < 480; ++v)
    for (int u = 1; u + 1 < 640; ++u) {
      const auto gone = [&](int du, int dv) {
        return noisy.depth_m[static_cast<std::size_t>(v + dv) * 640 + (u + du)] == 0.0f;
      };
      if (!gone(0, 0)) continue;
      holes += 1.0;
      single += gone(1, 0) || gone(-1, 0) || gone(0, 1) || gone(0, -1) ? 0.0 : 1.0;
    }
  ASSERT_GT(holes, 1000.0);
  EXPECT_LT(single / holes, 0.06);
}

TEST(ActiveStereo, WrongMatchesAreAsRareAsSaid) {
  ActiveStereoNoise noise = silent();
  noise.speckle_probability = 0.01;
  const CameraModel camera = sensor_camera();
  const auto d = disparities(noise, camera, image_of(camera, [](int, int) { return 12.0; }));
  const auto wrong = std::ranges::count_if(d, [](float value) { return std::abs(value - 12.0f) > 0.01f; });
  EXPECT_NEAR(static_cast<double>(wrong) / (640.0 * 480.0), 0.01, 0.001);
}

TEST(ActiveStereo, RowsAreLostWhole) {
  ActiveStereoNoise noise = silent();
  noise.row_loss_rate = 0.5;
  noise.row_loss_height_px = 10.0;
  const CameraModel camera = sensor_camera(64, 480);
  const DepthImage clean = image_of(camera, [](int, int) { return 12.0; });
  double lost = 0.0;
  for (std::uint32_t image = 0; image < 200; ++image) {
    const auto d = disparities(noise, camera, clean, image);
    for (int v = 0; v < 480; ++v) {
      const auto gone = std::count(d.begin() + v * 64, d.begin() + (v + 1) * 64, 0.0f);
      ASSERT_TRUE(gone == 0 || gone == 64);
      lost += gone == 64 ? 1.0 : 0.0;
    }
  }
  EXPECT_NEAR(lost / 200.0, 0.5 * 5.5, 0.6);
}

TEST(ActiveStereo, NearThingsGrowWhenToldTo) {
  ActiveStereoNoise noise = silent();
  noise.edge_step_px = 2.5;
  noise.edge_width_min_px = noise.edge_width_max_px = 0.0;
  noise.right_width_min_px = noise.right_width_max_px = 0.0;
  const CameraModel camera = sensor_camera(128, 400);
  const DepthImage clean = image_of(camera, [](int u, int) { return u >= 50 && u < 70 ? 20.0 : 10.0; });
  const auto near_px = [&] {
    return static_cast<double>(
               std::ranges::count_if(disparities(noise, camera, clean), [](float d) { return d > 15; })) /
           400.0;
  };
  EXPECT_DOUBLE_EQ(near_px(), 20.0);
  noise.fatten_px = 4.0;
  EXPECT_NEAR(near_px(), 28.0, 0.5);
}

}  // namespace
}  // namespace gatefield::scene
