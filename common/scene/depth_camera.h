#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "common/geometry/camera.h"
#include "common/scene/world.h"

namespace gatefield::scene {

/// Row-major z-depth in metres; 0 = no return (nearer than min, farther than max, or nothing there).
struct DepthImage {
  int width_px = 0;
  int height_px = 0;
  std::vector<float> depth_m;
};

/// What the noise model needs beside depth: per pixel the cosine of the angle of incidence and the reflectance.
struct SurfaceImage {
  std::vector<float> cos_incidence;
  std::vector<float> reflectance;
};

/// Which surface each pixel shows: kNoFace, kFloorFace, or 6 * box + face, with the boxes of solid_boxes() and the
/// faces -x, +x, -y, +y, -z, +z of a box in its own axes.
struct FaceImage {
  static constexpr std::int32_t kNoFace = -1;
  static constexpr std::int32_t kFloorFace = -2;
  std::vector<std::int32_t> face;
};

/// Ray-cast depth camera (Embree). The world is built once, then rendered from any number of poses.
/// Thread-safe: render() is const and may be called from several threads at once.
/// Real-time safe: no (first call allocates).
class DepthCamera {
 public:
  explicit DepthCamera(const World& world);
  ~DepthCamera();
  DepthCamera(DepthCamera&&) noexcept;
  DepthCamera& operator=(DepthCamera&&) noexcept;

  /// Clean z-depth seen by `camera` from X_WC (its X_BC is not used). `surface` and `faces` may be null.
  void render(const CameraModel& camera, const Eigen::Isometry3d& X_WC, DepthImage* image,
              SurfaceImage* surface = nullptr, FaceImage* faces = nullptr) const;

 private:
  struct Scene;
  std::unique_ptr<Scene> scene_;
};

}  // namespace gatefield::scene
