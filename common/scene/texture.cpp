#include "common/scene/texture.h"

#include <algorithm>
#include <cmath>

#include "common/base/multiversion.h"
#include "common/base/random.h"

namespace gatefield::scene {
namespace {

constexpr int kOctaves = 8;
constexpr float kCoarsest_m = 0.64f;
/// Variance of value noise: lattice values are uniform in [-1, 1) (variance 1/3); smoothstep's weights a, 1 - a keep
/// E[a^2 + (1 - a)^2] = 26/35 of it per axis.
constexpr float kVariance = (26.0f / 35.0f) * (26.0f / 35.0f) / 3.0f;

/// Mixes a lattice point into 32 bits (two rounds of multiply and shift).
inline std::uint32_t mix(std::uint32_t x, std::uint32_t y, std::uint32_t seed) noexcept {
  std::uint32_t h = (x * 0x8DA6B343u) ^ (y * 0xD8163841u) ^ seed;
  h ^= h >> 16;
  h *= 0x7FEB352Du;
  h ^= h >> 15;
  h *= 0x846CA68Bu;
  h ^= h >> 16;
  return h;
}

inline float lattice(std::uint32_t x, std::uint32_t y, std::uint32_t seed) noexcept {
  return static_cast<float>(static_cast<std::int32_t>(mix(x, y, seed))) * 0x1p-31f;
}

constexpr std::size_t kBlock = 512;

/// What the octaves leave in the cache for a block of points.
struct Sums {
  float weight[kBlock];
  float sum[kBlock];
  float squares[kBlock];
};

GATEFIELD_MULTIVERSION void add_octave(const float* __restrict s_m, const float* __restrict t_m,
                                       const float* __restrict footprint_m, const float* __restrict persistence,
                                       const std::uint32_t* __restrict seed, std::size_t count, float per_m,
                                       std::uint32_t octave_key, Sums* __restrict sums) {
  const float visible_m = 1.0f / (1.5f * per_m);
  for (std::size_t i = 0; i < count; ++i) {
    const float x = s_m[i] * per_m;
    const float y = t_m[i] * per_m;
    const float floor_x = std::floor(x);
    const float floor_y = std::floor(y);
    const auto ix = static_cast<std::uint32_t>(static_cast<std::int32_t>(floor_x));
    const auto iy = static_cast<std::uint32_t>(static_cast<std::int32_t>(floor_y));
    const std::uint32_t key = seed[i] + octave_key;
    const float v00 = lattice(ix, iy, key);
    const float v10 = lattice(ix + 1, iy, key);
    const float v01 = lattice(ix, iy + 1, key);
    const float v11 = lattice(ix + 1, iy + 1, key);
    const float fx = x - floor_x;
    const float fy = y - floor_y;
    const float ax = fx * fx * (3.0f - 2.0f * fx);
    const float ay = fy * fy * (3.0f - 2.0f * fy);
    const float v0 = v00 + (v10 - v00) * ax;
    const float v1 = v01 + (v11 - v01) * ax;
    // 1 when the wavelength is three footprints and more, 0 at one and a half and less.
    const float fade = std::min(std::max(visible_m / footprint_m[i] - 1.0f, 0.0f), 1.0f);
    const float weight = sums->weight[i];
    sums->sum[i] += weight * fade * (v0 + (v1 - v0) * ay);
    sums->squares[i] += weight * weight;
    sums->weight[i] = weight * persistence[i];
  }
}

}  // namespace

Material draw_material(std::uint64_t texture_seed, std::uint32_t object, Reflectance reflectance) {
  Random random(texture_seed, Stream("gatefield.texture"), object);
  Material material;
  material.albedo = std::clamp(reflectance * static_cast<float>(random.uniform(0.75, 1.25)), 0.03f, 0.95f);
  const double low = random.chance(0.25) ? 0.006 : 0.06;
  const double high = low < 0.05 ? 0.03 : 0.45;
  material.contrast = static_cast<float>(low * std::pow(high / low, random.uniform()));
  material.persistence = static_cast<float>(random.uniform(0.65, 1.0));
  material.stretch = static_cast<float>(std::exp(random.uniform(-0.6, 0.6)));
  material.seed = random.bits();
  return material;
}

void TexturePoints::resize(std::size_t count) {
  s_m.resize(count);
  t_m.resize(count);
  footprint_m.resize(count);
  persistence.resize(count);
  seed.resize(count);
}

void fractal_noise(const TexturePoints& points, std::span<float> value) {
  Sums sums;
  for (std::size_t first = 0; first < value.size(); first += kBlock) {
    const std::size_t count = std::min(kBlock, value.size() - first);
    std::fill_n(sums.weight, count, 1.0f);
    std::fill_n(sums.sum, count, 0.0f);
    std::fill_n(sums.squares, count, 0.0f);
    float per_m = 1.0f / kCoarsest_m;
    const float finest_m = *std::min_element(points.footprint_m.begin() + static_cast<std::ptrdiff_t>(first),
                                             points.footprint_m.begin() + static_cast<std::ptrdiff_t>(first + count));
    for (std::uint32_t octave = 0; octave < kOctaves; ++octave) {
      if (1.0f / (1.5f * per_m) <= finest_m) {
        // Nothing of this octave or of finer ones shows; they only count as contrast that is lost.
        for (std::size_t i = 0; i < count; ++i) {
          sums.squares[i] += sums.weight[i] * sums.weight[i];
          sums.weight[i] *= points.persistence[first + i];
        }
        continue;
      }
      add_octave(points.s_m.data() + first, points.t_m.data() + first, points.footprint_m.data() + first,
                 points.persistence.data() + first, points.seed.data() + first, count, per_m, octave * 0x9E3779B9u,
                 &sums);
      per_m *= 2.0f;
    }
    for (std::size_t i = 0; i < count; ++i) value[first + i] = sums.sum[i] / std::sqrt(sums.squares[i] * kVariance);
  }
}

}  // namespace gatefield::scene
