#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/scene/world.h"

namespace gatefield::scene {

/// How a surface looks to a passive camera: brightness = albedo (1 + contrast n(s, t)), n = fractal_noise().
struct Material {
  float albedo = 0.5f;       ///< mean share of the light that comes back
  float contrast = 0.2f;     ///< standard deviation of the pattern, relative to albedo; 0.01 is a painted wall
  float persistence = 0.7f;  ///< how much weaker each octave is than the one that is twice as coarse
  float stretch = 1.0f;      ///< scales the pattern's size
  std::uint32_t seed = 0;    ///< names the pattern
};

/// Draws the material of an object: its albedo lies around the reflectance, a quarter of the objects is nearly without
/// texture. The same (seed, object) gives the same material.
/// Thread-safe: yes.   Real-time safe: yes.
Material draw_material(std::uint64_t texture_seed, std::uint32_t object, Reflectance reflectance);

/// Points on surfaces, one array per quantity.
struct TexturePoints {
  std::vector<float> s_m, t_m;      ///< position in the surface's own coordinates, times 1 / stretch
  std::vector<float> footprint_m;   ///< size of what one pixel covers, times 1 / stretch
  std::vector<float> persistence;   ///< see Material
  std::vector<std::uint32_t> seed;  ///< of the pattern

  void resize(std::size_t count);
  std::size_t size() const noexcept { return s_m.size(); }
};

/// Eight octaves of value noise, wavelengths 0.64 m down to 5 mm, mean 0 and standard deviation 1 when seen from near:
///   n = sum_k w_k v_k(s, t) / sqrt(sum_k w_k^2 var v),  w_k = persistence^k,
/// where v_k interpolates (smoothstep) between hashed values on a square lattice. An octave fades out where its
/// wavelength comes near one and a half footprints, as it does in a lens: no aliasing, and far surfaces have less
/// contrast.
/// @pre value.size() <= points.size()
/// Thread-safe: yes.   Real-time safe: yes.
void fractal_noise(const TexturePoints& points, std::span<float> value);

}  // namespace gatefield::scene
