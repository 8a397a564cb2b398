#include "common/config/sensor_noise_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

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
