#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <span>
#include <vector>

#include "common/geometry/camera.h"
#include "common/protocol/messages.h"

namespace gatefield::perception {

/// A depth image as it came over the wire. @pre pixels.size() == width * height * bytes_per_pixel(encoding)
struct WireImage {
  std::span<const std::uint8_t> pixels;
  protocol::DepthEncoding encoding = protocol::DepthEncoding::kCounts16;

  std::size_t size() const noexcept { return pixels.size() / protocol::bytes_per_pixel(encoding); }
};

/// Calls use(i, z_m, at_end) for every pixel, row by row. z_m is what the camera's unit makes of it and may be anything
/// for kMetres32; at_end: the largest count there is, which stands for "farther than can be said".
template <typename Use>
void for_each_depth(const WireImage& image, const CameraModel& camera, const Use& use) {
  // The wire is little endian; so is every machine this is built for.
  static_assert(std::endian::native == std::endian::little);
  const std::size_t size = image.size();
  if (image.encoding == protocol::DepthEncoding::kCounts16) {
    const auto metres = static_cast<float>(camera.metres_per_count);
    for (std::size_t i = 0; i < size; ++i) {
      std::uint16_t count;
      std::memcpy(&count, image.pixels.data() + 2 * i, sizeof count);
      use(i, metres * static_cast<float>(count), count == std::numeric_limits<std::uint16_t>::max());
    }
  } else {
    for (std::size_t i = 0; i < size; ++i) {
      float z;
      std::memcpy(&z, image.pixels.data() + 4 * i, sizeof z);
      use(i, z, false);
    }
  }
}

struct DecodedDepth {
  std::size_t returns = 0;    ///< pixels with a depth within the camera's range
  std::size_t saturated = 0;  ///< pixels at the encoding's largest value or beyond the camera's range
};
/// Float metres from what came over the wire. Values that are not finite, nearer than the camera's least depth or
/// farther than its largest become 0 (no return).
/// @param depth_m  out, resized to width * height
/// @param factor   on every depth: the image as it would be if the unit were another one
DecodedDepth decode_depth(const WireImage& image, const CameraModel& camera, std::vector<float>* depth_m,
                          float factor = 1.0f);

}  // namespace gatefield::perception
