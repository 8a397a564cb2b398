#include "client/simulator/motion_blur.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "client/simulator/depth_sensor.h"
#include "common/config/locate.h"

namespace gatefield::simulator {
namespace {

constexpr double kFocal_px = 84.3, kBaseline_m = 0.05;

/// One row; a moment each line.
struct Merged {
  scene::DepthImage depth;
  scene::SurfaceImage surface;
};
Merged merge(const std::vector<std::vector<float>>& moments) {
  std::vector<scene::DepthImage> images;
  std::vector<scene::SurfaceImage> surfaces;
  for (const auto& moment : moments) {
    images.push_back({160, 1, moment});
    const auto number = static_cast<float>(images.size());
    surfaces.push_back({std::vector<float>(moment.size(), 0.1f * number), std::vector<float>(moment.size(), 0.5f)});
  }
  Merged merged;
  merge_exposure(images, surfaces, kFocal_px, kBaseline_m, &merged.depth, &merged.surface);
  return merged;
}

TEST(MotionBlur, WhatStoodStillStaysAsItIs) {
  const std::vector<float> row{0.5f, 2.0f, 9.0f, 0.0f};
  EXPECT_EQ(merge({row, row, row, row, row}).depth.depth_m, row);
}

TEST(MotionBlur, ASurfaceThatComesNearerHasTheDepthOfTheMiddle) {
  const Merged merged = merge({{2.10f}, {2.05f}, {2.00f}, {1.95f}, {1.90f}});
  EXPECT_EQ(merged.depth.depth_m[0], 2.00f);
  EXPECT_FLOAT_EQ(merged.surface.cos_incidence[0], 0.3f) << "the surface of that moment";
}

TEST(MotionBlur, AnEdgeThatSweepsOverPixelsIsLostWhereNeitherSideHasEnoughOfTheLight) {
  // A post at 2 m before 6 m comes in from the left, a pixel a moment.
  std::vector<std::vector<float>> moments;
  for (std::size_t i = 0; i < 5; ++i) {
    moments.emplace_back(6, 6.0f);
    std::fill_n(moments.back().begin(), i + 1, 2.0f);
  }
  EXPECT_EQ(merge(moments).depth.depth_m, (std::vector<float>{2.0f, 2.0f, 0.0f, 0.0f, 6.0f, 6.0f}))
      << "covered in 5, 4, 3, 2, 1 and no moment of 5";
}

TEST(MotionBlur, SmallStepsOfDisparityAreOneSurface) {
  // At 6 and 8 m the disparities are 0.70 and 0.53 px: too near to each other to be told apart.
  EXPECT_EQ(merge({{6.0f}, {6.0f}, {8.0f}, {8.0f}, {8.0f}}).depth.depth_m[0], 8.0f);
  EXPECT_EQ(merge({{2.0f}, {2.0f}, {8.0f}, {8.0f}, {8.0f}}).depth.depth_m[0], 0.0f);
  EXPECT_EQ(merge({{0.0f}, {0.0f}, {0.0f}, {8.0f}, {8.0f}}).depth.depth_m[0], 0.0f) << "nothing there is far away";
}

TEST(DepthSensor, AnExposureOfAFastTurnCostsEdges) {
  auto scenario = config::load_scenario(config::find_config("scenarios", "circle-0.3m").value()).value();
  scenario.sensor_noise.scale = 0;
  const scene::World world = config::true_world(scenario);
  DepthSensor sensor(world, scenario);
  const auto poses = [&](double rate_rad_s) {
    std::vector<Eigen::Isometry3d> X_WB;
    for (int i = -2; i <= 2; ++i)
      X_WB.push_back(Eigen::Translation3d(scenario.track.start_p_WB) *
                     Eigen::AngleAxisd(scenario.track.start_yaw_rad + 2e-3 * i * rate_rad_s, Eigen::Vector3d::UnitZ()));
    return X_WB;
  };
  const auto returns = [&](double rate_rad_s) {
    const auto& depth_m = sensor.capture(std::span<const Eigen::Isometry3d>(poses(rate_rad_s))).depth_m;
    return std::count_if(depth_m.begin(), depth_m.end(), [](float z_m) { return z_m > 0; });
  };
  const auto sharp = sensor.capture(poses(0)[2]).depth_m;
  EXPECT_EQ(sensor.capture(std::span<const Eigen::Isometry3d>(poses(0))).depth_m, sharp) << "stands still";
  EXPECT_LT(returns(6.0), returns(0.0) - 50);
  EXPECT_GT(returns(6.0), returns(0.0) * 3 / 4);
}

TEST(DepthSensor, HangsADegreeOffInADirectionThatTheSeedDraws) {
  auto scenario = config::load_scenario(config::find_config("scenarios", "circle-0.3m").value()).value();
  const scene::World world = config::true_world(scenario);
  const Eigen::Isometry3d told = scenario.vehicle.camera.X_BC;
  EXPECT_TRUE(DepthSensor(world, scenario).camera().X_BC.isApprox(told, 0.0));
  scenario.hard = config::hard_world({config::WorldPart::kMounting});
  Eigen::Vector3d last = Eigen::Vector3d::Zero();
  for (scenario.seed = 1; scenario.seed <= 10; ++scenario.seed) {
    const Eigen::Isometry3d truth = DepthSensor(world, scenario).camera().X_BC;
    const Eigen::AngleAxisd off(told.linear().transpose() * truth.linear());
    EXPECT_NEAR(off.angle(), 0.017453292519943295, 1e-9);
    EXPECT_EQ(truth.translation(), told.translation());
    EXPECT_GT((off.axis() - last).norm(), 1e-3);
    last = off.axis();
  }
}

}  // namespace
}  // namespace gatefield::simulator
