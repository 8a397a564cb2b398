#include "server/perception/depth_image.h"

namespace gatefield::perception {

DecodedDepth decode_depth(const WireImage& image, const CameraModel& camera, std::vector<float>* depth_m,
                          float factor) {
  const auto nearest = static_cast<float>(camera.min_depth_m);
  const auto farthest = static_cast<float>(camera.max_depth_m);
  depth_m->resize(image.size());
  DecodedDepth result;
  for_each_depth(image, camera, [&](std::size_t i, float told_m, bool at_end) {
    const float z = factor * told_m;
    if (z > farthest || at_end) ++result.saturated;
    const bool good = z >= nearest && z <= farthest;  // false for NaN
    result.returns += good ? 1 : 0;
    (*depth_m)[i] = good ? z : 0.0f;
  });
  return result;
}

}  // namespace gatefield::perception
