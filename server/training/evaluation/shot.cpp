#include "server/training/evaluation/shot.h"

namespace gatefield::training {

Shot take_shot(const scene::DepthCamera& camera, const scene::World& world, std::size_t gates,
               const Eigen::Isometry3d& X_WC, const scene::SensorNoise& noise, Random* random) {
  scene::DepthImage clean, noisy;
  scene::SurfaceImage surface;
  camera.render(dataset_camera(), X_WC, &clean, &surface);
  scene::apply_noise(noise, dataset_camera(), clean, surface, random, &noisy);
  std::vector<std::uint16_t> clean_mm;
  for (const float depth_m : clean.depth_m) clean_mm.push_back(static_cast<std::uint16_t>(depth_m * 1000.0f + 0.5f));
  Shot shot;
  for (std::size_t i = 0; i < gates; ++i) {
    const Eigen::Isometry3d X_CG = X_WC.inverse() * world.gates[i].X_WG;
    GateLabel label;
    label.p_CG = X_CG.translation().cast<float>();
    label.q_CG = Eigen::Quaterniond(X_CG.linear()).normalized().cast<float>();
    label.shape = world.gates[i].shape;
    label.visible_fraction = visible_fraction(dataset_camera(), clean_mm, label.shape, label.X_CG());
    shot.gates.push_back(label);
  }
  shot.clean_m = std::move(clean.depth_m);
  shot.noisy_m = std::move(noisy.depth_m);
  return shot;
}

}  // namespace gatefield::training
