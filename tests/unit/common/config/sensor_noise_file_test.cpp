#include "common/config/sensor_noise_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "tests/unit/common/config/temporary_file.h"

namespace gatefield::config {
namespace {

using testing::HasSubstr;

TEST(SensorNoiseFile, WhatIsWrittenIsRead) {
  scene::SensorNoise noise;
  noise.baseline_m = 0.055;
  noise.disparity_noise_px = 0.041;
  noise.disparity_step_px = 0.0;
  noise.bleed_probability = 0.12;
  noise.shadow_probability = 0.3;
  noise.hole_rate_per_image = 7.25;
  noise.hole_radius_px = 2.5;
  noise.speckle_probability = 0.0012;
  noise.incidence_loss = 0.9;
  noise.reflectance_loss = 0.1;
  noise.scale = 1.5;
  const TemporaryFile file("");
  ASSERT_TRUE(save_sensor_noise(file.path(), noise, {{"", "a head"}, {"hole_radius_px", "kept"}}).ok());
  const auto read = load_sensor_noise(file.path());
  ASSERT_TRUE(read.ok()) << read.error();
  EXPECT_DOUBLE_EQ(read->baseline_m, 0.055);
  EXPECT_DOUBLE_EQ(read->disparity_noise_px, 0.041);
  EXPECT_DOUBLE_EQ(read->disparity_step_px, 0.0);
  EXPECT_DOUBLE_EQ(read->bleed_probability, 0.12);
  EXPECT_DOUBLE_EQ(read->shadow_probability, 0.3);
  EXPECT_DOUBLE_EQ(read->hole_rate_per_image, 7.25);
  EXPECT_DOUBLE_EQ(read->hole_radius_px, 2.5);
  EXPECT_DOUBLE_EQ(read->speckle_probability, 0.0012);
  EXPECT_DOUBLE_EQ(read->incidence_loss, 0.9);
  EXPECT_DOUBLE_EQ(read->reflectance_loss, 0.1);
  EXPECT_DOUBLE_EQ(read->scale, 1.5);
  EXPECT_THAT(read_all(file.path()), HasSubstr("# a head\n"));
  EXPECT_THAT(read_all(file.path()), HasSubstr("# kept\nhole_radius_px: 2.5"));
}

TEST(SensorNoiseFile, TheMeasuredModelIsWrittenAndRead) {
  scene::SensorNoise noise;
  noise.scale = 0.75;
  scene::ActiveStereoNoise& stereo = noise.active_stereo.emplace();
  double value = 0.0;
  for (const auto& field : scene::active_stereo_fields()) {  // each its own, within its range
    value += 0.001;
    stereo.*field.value = field.low + value * (field.high - field.low);
  }
  stereo.clouds = {{1.5, 0.25, 0.125}, {4.0, 0.5, 0.75}};
  const TemporaryFile file("");
  ASSERT_TRUE(save_sensor_noise(file.path(), noise, {{"", "a head"}, {"white_px", "fitted"}}).ok());
  const auto read = load_sensor_noise(file.path());
  ASSERT_TRUE(read.ok()) << read.error();
  EXPECT_DOUBLE_EQ(read->scale, 0.75);
  ASSERT_TRUE(read->active_stereo);
  for (const auto& field : scene::active_stereo_fields())
    EXPECT_NEAR((*read->active_stereo).*field.value, stereo.*field.value, 1e-5 * std::abs(stereo.*field.value))
        << field.name;
  ASSERT_EQ(read->active_stereo->clouds.size(), 2u);
  EXPECT_DOUBLE_EQ(read->active_stereo->clouds[1].at_m, 4.0);
  EXPECT_DOUBLE_EQ(read->active_stereo->clouds[1].small_px, 0.5);
  EXPECT_DOUBLE_EQ(read->active_stereo->clouds[1].large_px, 0.75);
  EXPECT_THAT(read_all(file.path()), HasSubstr("# fitted\nwhite_px: "));
  EXPECT_THAT(read_all(file.path()), HasSubstr("# a head\n"));
}

TEST(SensorNoiseFile, EmptyActiveStereoIsAD435) {
  const TemporaryFile file("active_stereo { white_px: 0.05 }");
  const auto read = load_sensor_noise(file.path());
  ASSERT_TRUE(read.ok()) << read.error();
  ASSERT_TRUE(read->active_stereo);
  EXPECT_DOUBLE_EQ(read->active_stereo->white_px, 0.05);
  EXPECT_DOUBLE_EQ(read->active_stereo->band_px, 6.5);
  EXPECT_EQ(read->active_stereo->clouds.size(), 6u);
}

TEST(SensorNoiseFile, TheShippedD435IsTheDefault) {
  const auto read =
      load_sensor_noise(std::filesystem::path(GATEFIELD_SOURCE_DIR) / "deploy/config/sensor-noise/d435.txt");
  ASSERT_TRUE(read.ok()) << read.error();
  ASSERT_TRUE(read->active_stereo);
  const scene::ActiveStereoNoise standard;
  for (const auto& field : scene::active_stereo_fields())
    EXPECT_DOUBLE_EQ((*read->active_stereo).*field.value, standard.*field.value) << field.name;
  ASSERT_EQ(read->active_stereo->clouds.size(), standard.clouds.size());
  for (std::size_t i = 0; i < standard.clouds.size(); ++i) {
    EXPECT_DOUBLE_EQ(read->active_stereo->clouds[i].at_m, standard.clouds[i].at_m);
    EXPECT_DOUBLE_EQ(read->active_stereo->clouds[i].small_px, standard.clouds[i].small_px);
    EXPECT_DOUBLE_EQ(read->active_stereo->clouds[i].large_px, standard.clouds[i].large_px);
  }
}

TEST(SensorNoiseFile, OneModelAtATime) {
  const TemporaryFile both("active_stereo { } hole_radius_px: 3");
  EXPECT_THAT(load_sensor_noise(both.path()).error(), HasSubstr("hole_radius_px"));
  const TemporaryFile wrong("active_stereo { gain_min: 3 }");
  EXPECT_EQ(load_sensor_noise(wrong.path()).failure().field, "noise.active_stereo.gain_max");
}

TEST(SensorNoiseFile, ErrorsNameFileAndField) {
  const TemporaryFile wrong("disparity_noise_px: 11");
  EXPECT_THAT(load_sensor_noise(wrong.path()).error(), HasSubstr("noise.disparity_noise_px"));
  EXPECT_EQ(load_sensor_noise(wrong.path()).failure().field, "noise.disparity_noise_px");
  const TemporaryFile unknown("wobble: 1");
  EXPECT_THAT(load_sensor_noise(unknown.path()).error(), HasSubstr("wobble"));
  EXPECT_FALSE(save_sensor_noise(wrong.path() / "noise.txt", {}).ok());
}

}  // namespace
}  // namespace gatefield::config
