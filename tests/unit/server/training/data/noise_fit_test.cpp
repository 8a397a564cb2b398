#include "server/training/data/noise_fit.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>

#include "server/training/data/sensor_figures.h"
#include "server/training/data/true_depth.h"

namespace gatefield::training {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

class NoiseFitting : public testing::Test {
 protected:
  fs::path folder_ = fs::path(testing::TempDir()) / ("gatefield-fit-" + std::to_string(::getpid()));
  void SetUp() override { fs::create_directories(folder_); }
  void TearDown() override { fs::remove_all(folder_); }

  /// Simulated scenes under known noise, as a recording with true depth; `still`: one scene again and again, without.
  Dataset record(const scene::SensorNoise& noise, std::uint64_t frames, bool still = false) {
    const fs::path file = folder_ / "recording.h5";
    fs::remove(file);
    DatasetInfo info;
    info.kind = still ? DatasetKind::kRecording : DatasetKind::kStereo;
    auto writer = DatasetWriter::open(file, info, {});
    EXPECT_TRUE(writer.ok());
    Random random(8, 8);
    std::vector<float> depth_m(kImageSize_px);
    for (std::uint64_t i = 0; i < frames; ++i) {
      const Sample scene = generate(4711, still ? 3 : i);
      draw_noisy(scene.view(), noise, &random, depth_m);
      Sample sample = scene;
      sample.surface.clear();
      sample.X_WC.reset();
      if (still) sample.clean_mm.clear();
      sample.measured_mm.resize(kImageSize_px);
      for (std::size_t k = 0; k < kImageSize_px; ++k) {
        sample.measured_mm[k] = static_cast<std::uint16_t>(depth_m[k] * 1000.0f + 0.5f);
      }
      const Status added = writer.value().append(sample);
      EXPECT_TRUE(added.ok()) << added.error();
    }
    EXPECT_TRUE(writer.value().close().ok());
    auto dataset = Dataset::open(file);
    EXPECT_TRUE(dataset.ok()) << dataset.error();
    return std::move(dataset).value();
  }
};

void expect_near(const scene::SensorNoise& found, const scene::SensorNoise& true_noise) {
  EXPECT_NEAR(found.disparity_noise_px, true_noise.disparity_noise_px, 0.05 * true_noise.disparity_noise_px);
  EXPECT_NEAR(found.disparity_step_px, true_noise.disparity_step_px, 0.01 * true_noise.disparity_step_px);
  EXPECT_NEAR(found.bleed_probability, true_noise.bleed_probability, 0.06);
  EXPECT_NEAR(found.shadow_probability, true_noise.shadow_probability, 0.06);
  EXPECT_NEAR(found.hole_rate_per_image, true_noise.hole_rate_per_image, 0.25 * true_noise.hole_rate_per_image);
  EXPECT_NEAR(found.hole_radius_px, true_noise.hole_radius_px, 0.15 * true_noise.hole_radius_px);
  EXPECT_NEAR(found.speckle_probability, true_noise.speckle_probability, 0.15 * true_noise.speckle_probability);
  EXPECT_NEAR(found.incidence_loss, true_noise.incidence_loss, 0.08);
}

TEST_F(NoiseFitting, FindsTheStandardNoiseAgain) {
  const auto fit = fit_noise(record({}, 200), {});
  ASSERT_TRUE(fit.ok()) << fit.error();
  SCOPED_TRACE(to_text(*fit));
  expect_near(fit->noise, {});
  EXPECT_NEAR(fit->bias_px, 0.0, 0.002);
}

TEST_F(NoiseFitting, FindsAnotherNoiseAgain) {
  scene::SensorNoise noise;
  noise.disparity_noise_px = 0.06;
  noise.disparity_step_px = 0.02;
  noise.bleed_probability = 0.15;
  noise.shadow_probability = 0.4;
  noise.hole_rate_per_image = 8.0;
  noise.hole_radius_px = 2.5;
  noise.speckle_probability = 0.01;
  noise.incidence_loss = 0.3;
  const auto fit = fit_noise(record(noise, 200), {});
  ASSERT_TRUE(fit.ok()) << fit.error();
  SCOPED_TRACE(to_text(*fit));
  expect_near(fit->noise, noise);
}

TEST_F(NoiseFitting, FindsNothingWhereThereIsNothing) {
  scene::SensorNoise none;
  none.scale = 0.0;
  const auto fit = fit_noise(record(none, 60), {});
  ASSERT_TRUE(fit.ok()) << fit.error();
  SCOPED_TRACE(to_text(*fit));
  EXPECT_LT(fit->noise.disparity_noise_px, 1e-3);
  EXPECT_EQ(fit->noise.disparity_step_px, 0.0);
  EXPECT_LT(fit->noise.bleed_probability, 0.01);
  EXPECT_LT(fit->noise.shadow_probability, 0.01);
  EXPECT_EQ(fit->noise.hole_rate_per_image, 0.0);
  EXPECT_LT(fit->noise.speckle_probability, 1e-5);
  EXPECT_LT(fit->noise.incidence_loss, 0.01);
  EXPECT_EQ(fit->noise.reflectance_loss, 0.0);
}

TEST_F(NoiseFitting, AStaticSceneIsItsOwnTruth) {
  NoiseFitOptions options;
  options.static_scene = true;
  const auto fit = fit_noise(record({}, 200, true), options);
  ASSERT_TRUE(fit.ok()) << fit.error();
  SCOPED_TRACE(to_text(*fit));
  EXPECT_NEAR(fit->noise.disparity_noise_px, 0.03, 0.003);
  EXPECT_NEAR(fit->noise.disparity_step_px, 0.00625, 1e-4);
  EXPECT_NEAR(fit->noise.speckle_probability, 0.003, 0.001);
  EXPECT_NEAR(fit->noise.hole_rate_per_image, 3.0, 1.5);
  EXPECT_NEAR(fit->noise.hole_radius_px, 4.0, 1.2);
  EXPECT_NEAR(fit->bias_px, 0.0, 0.002);
}

TEST_F(NoiseFitting, SaysWhatTheRecordingLacks) {
  const Dataset still = record({}, 20, true);
  EXPECT_THAT(fit_noise(still, {}).error(), HasSubstr("--static"));
  NoiseFitOptions options;
  options.static_scene = true;
  EXPECT_THAT(fit_noise(record({}, 5, true), options).error(), HasSubstr("at least 16"));
  const fs::path file = folder_ / "simulation.h5";
  DatasetOptions generated;
  generated.count = 4;
  generated.threads = 1;
  ASSERT_TRUE(generate_dataset(file, generated).ok());
  const auto simulation = Dataset::open(file);
  ASSERT_TRUE(simulation.ok());
  EXPECT_THAT(fit_noise(*simulation, {}).error(), HasSubstr("no measured depth"));
  EXPECT_FALSE(compare_sensors(*simulation, {}, 10).ok());
}

TEST_F(NoiseFitting, FiguresOfTheModelMatchThoseOfARecordingMadeWithIt) {
  scene::SensorNoise noise;
  noise.reflectance_loss = 0.0;
  const auto comparison = compare_sensors(record(noise, 100), noise, 100);
  ASSERT_TRUE(comparison.ok()) << comparison.error();
  SCOPED_TRACE(to_text(*comparison));
  for (std::size_t bin = 0; bin < kDepths_m.size(); ++bin) {
    const SensorFigures& measured = comparison->measured[bin];
    const SensorFigures& model = comparison->model[bin];
    EXPECT_NEAR(measured.fill, model.fill, 0.015) << bin;
    EXPECT_NEAR(measured.sigma_px, model.sigma_px, 0.002) << bin;
    EXPECT_NEAR(measured.edge_wrong, model.edge_wrong, 0.03) << bin;
    EXPECT_NEAR(measured.neighbour, 0.0, 0.05) << bin;
  }
  EXPECT_NEAR(comparison->measured[0].sigma_px, std::hypot(0.03, 0.00625 / std::sqrt(12.0)), 0.001);
}

TEST(TrueDepth, KnowsEdgesShadowsAndIncidence) {
  const CameraModel& camera = dataset_camera();
  // A wall at 4 m and, in the right half, one at 2 m.
  std::vector<float> z_m(kImageSize_px);
  for (int i = 0; i < kImageSize_px; ++i) z_m[static_cast<std::size_t>(i)] = i % kImageWidth_px < 80 ? 4.0f : 2.0f;
  TrueDepth truth;
  examine(camera, 0.5, z_m, &truth);
  const std::size_t row = 40 * kImageWidth_px;
  for (int u = 0; u < kImageWidth_px; ++u) {
    const std::size_t i = row + static_cast<std::size_t>(u);
    EXPECT_EQ(truth.edge[i] != 0, u == 79 || u == 80) << u;
    EXPECT_EQ(truth.inside[i] != 0, u < 76 || u > 83) << u;
    EXPECT_NEAR(static_cast<double>(truth.cosine[i]), 1.0 / camera.ray_C(u, 40).norm(), 1e-4) << u;
  }
  // The near wall moves by fx b (1/2 - 1/4) = 10.5 px over the far one.
  int hidden = 0;
  for (std::size_t u = 0; u < 80; ++u) hidden += truth.shadow[row + u];
  EXPECT_EQ(hidden, 10);

  // A floor 1 m below a level camera: the cosine of incidence is the ray's downward part.
  for (int v = 0; v < kImageHeight_px; ++v) {
    const double y = camera.ray_C(0, v).y();
    for (int u = 0; u < kImageWidth_px; ++u) {
      z_m[static_cast<std::size_t>(v * kImageWidth_px + u)] = y > 0.1 ? static_cast<float>(1.0 / y) : 0.0f;
    }
  }
  examine(camera, 0.05, z_m, &truth);
  for (int v = 70; v < kImageHeight_px; ++v) {
    for (int u = 0; u < kImageWidth_px; ++u) {
      const Eigen::Vector3d ray = camera.ray_C(u, v);
      EXPECT_NEAR(static_cast<double>(truth.cosine[static_cast<std::size_t>(v * kImageWidth_px + u)]),
                  ray.y() / ray.norm(), 1e-3);
    }
  }
}

}  // namespace
}  // namespace gatefield::training
