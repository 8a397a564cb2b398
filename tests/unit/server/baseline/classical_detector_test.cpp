#include "server/baseline/classical_detector.h"

#include <gtest/gtest.h>

#include "tests/unit/server/baseline/fixtures.h"

namespace gatefield::baseline {
namespace {

TEST(ClassicalDetector, FindsAGateInANoisyImageFromAnHonestPrior) {
  ClassicalDetector detector{GateShape{}};
  int found = 0, good = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Random random(seed, 7);
    const Eigen::Vector3d center_W(random.uniform(2.5, 5.0), random.uniform(-0.8, 0.8), random.uniform(1.3, 1.8));
    const Scene scene = scene_with(center_W, random.uniform(-0.7, 0.7), seed);
    const Eigen::Vector3d prior_C =
        scene.X_CG().translation() + Eigen::Vector3d(random.uniform(-0.2, 0.2), random.uniform(-0.1, 0.1), 0.2);
    const auto detection = detector.detect(scene.depth_m, scene.camera, prior_C);
    if (!detection) continue;
    ++found;
    good += (detection->X_CG.translation().cast<double>() - scene.X_CG().translation()).norm() < 0.1 &&
            turn_between(detection->X_CG.cast<double>(), scene.X_CG()) < 0.15;
  }
  EXPECT_GE(found, 17);
  EXPECT_GE(good, 15);
}

TEST(ClassicalDetector, FindsTheGateInViewWithoutAPrior) {
  ClassicalDetector detector{GateShape{}};
  const Scene scene = scene_with({4, 0.3, 1.6}, 0.2);
  const auto detection = detector.detect(scene.depth_m, scene.camera, std::nullopt);
  ASSERT_TRUE(detection.has_value());
  EXPECT_LT((detection->X_CG.translation().cast<double>() - scene.X_CG().translation()).norm(), 0.1);
}

TEST(ClassicalDetector, SeesNoGateWhereThereIsNone) {
  ClassicalDetector detector{GateShape{}};
  Scene scene = scene_with({4, 0, 1.5}, 0);
  scene.world.gates[0].X_WG.translation().x() = -4;  // behind the camera
  scene::DepthImage image;
  scene::DepthCamera(scene.world).render(scene.camera, scene.X_WC, &image);
  EXPECT_FALSE(detector.detect(image.depth_m, scene.camera, std::nullopt).has_value());
  EXPECT_FALSE(detector.detect(image.depth_m, scene.camera, Eigen::Vector3d(0, 0, 4)).has_value());
  std::fill(image.depth_m.begin(), image.depth_m.end(), 0.0f);
  EXPECT_FALSE(detector.detect(image.depth_m, scene.camera, std::nullopt).has_value());
}

}  // namespace
}  // namespace gatefield::baseline
