#include "common/scene/noise_planes.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/base/multiversion.h"

namespace gatefield::scene {
namespace {

constexpr double kWhite_px = 0.2;

/// A Gaussian over 3 sigma to each side whose squares add up to 1: what it blurs keeps its variance.
std::vector<float> kernel_of(double sigma_px) {
  if (sigma_px < kWhite_px) return {1.0f};
  const int reach_px = std::max(1, static_cast<int>(std::ceil(3.0 * sigma_px)));
  std::vector<float> kernel;
  double squares = 0.0;
  for (int i = -reach_px; i <= reach_px; ++i) {
    const double weight = std::exp(-0.5 * i * i / (sigma_px * sigma_px));
    kernel.push_back(static_cast<float>(weight));
    squares += weight * weight;
  }
  for (float& weight : kernel) weight = static_cast<float>(weight / std::sqrt(squares));
  return kernel;
}

/// to[i] = sum over k of kernel[k] from[i + k stride]; sums run side by side, none is reordered.
GATEFIELD_MULTIVERSION void blur(const float* from, std::size_t stride, const float* kernel, std::size_t taps,
                                 std::size_t count, float* to) {
  for (std::size_t i = 0; i < count; ++i) to[i] = 0.0f;
  for (std::size_t k = 0; k < taps; ++k) {
    const float weight = kernel[k];
    const float* const shifted = from + k * stride;
    for (std::size_t i = 0; i < count; ++i) to[i] += weight * shifted[i];
  }
}

}  // namespace

const std::array<float, kNormals>& normal_table() {
  static const std::array<float, kNormals> table = [] {
    std::array<double, kNormals> quantiles{};
    double sum_squares = 0.0;
    for (std::size_t i = 0; i < kNormals; ++i) {
      const double probability = (static_cast<double>(i) + 0.5) / static_cast<double>(kNormals);
      double low = -8.0;
      double high = 8.0;
      for (int step = 0; step < 50; ++step) {
        const double middle = 0.5 * (low + high);
        (0.5 * std::erfc(-middle / std::numbers::sqrt2) < probability ? low : high) = middle;
      }
      quantiles[i] = 0.5 * (low + high);
      sum_squares += quantiles[i] * quantiles[i];
    }
    const double to_unit = std::sqrt(static_cast<double>(kNormals) / sum_squares);
    std::array<float, kNormals> result{};
    for (std::size_t i = 0; i < kNormals; ++i) result[i] = static_cast<float>(quantiles[i] * to_unit);
    return result;
  }();
  return table;
}

GATEFIELD_MULTIVERSION void fill_bits(std::uint32_t key0, std::uint32_t key1, std::uint32_t plane, std::size_t blocks,
                                      std::uint32_t* plane0, std::uint32_t* plane1, std::uint32_t* plane2,
                                      std::uint32_t* plane3) {
  for (std::size_t i = 0; i < blocks; ++i) {
    const auto block = philox({static_cast<std::uint32_t>(i), 0, plane, 0}, {key0, key1});
    plane0[i] = block[0];
    plane1[i] = block[1];
    plane2[i] = block[2];
    plane3[i] = block[3];
  }
}

void draw_field(std::array<std::uint32_t, 2> key, std::uint32_t plane, int width_px, int height_px, double sigma_px,
                std::vector<float>* field) {
  static thread_local std::vector<std::uint32_t> bits;
  static thread_local std::vector<float> white, rows;
  const std::vector<float> kernel = kernel_of(sigma_px);
  const std::size_t margin = kernel.size() - 1;
  const auto width = static_cast<std::size_t>(width_px), height = static_cast<std::size_t>(height_px);
  const std::size_t wide = width + margin, high = height + margin;
  const std::size_t blocks = (wide * high + 3) / 4;
  bits.resize(4 * blocks);
  fill_bits(key[0], key[1], plane, blocks, bits.data(), bits.data() + blocks, bits.data() + 2 * blocks,
            bits.data() + 3 * blocks);
  const float* const table = normal_table().data();
  white.resize(wide * high);
  for (std::size_t i = 0; i < white.size(); ++i) white[i] = table[bits[i] >> (32 - kNormalBits)];
  rows.resize(width * high);
  for (std::size_t v = 0; v < high; ++v)
    blur(white.data() + v * wide, 1, kernel.data(), kernel.size(), width, rows.data() + v * width);
  field->resize(width * height);
  for (std::size_t v = 0; v < height; ++v)
    blur(rows.data() + v * width, width, kernel.data(), kernel.size(), width, field->data() + v * width);
}

int poisson(double mean, Random* random) {
  const double limit = std::exp(-mean);
  double product = random->uniform();
  int count = 0;
  while (product > limit && count < 1000) {
    product *= random->uniform();
    ++count;
  }
  return count;
}

}  // namespace gatefield::scene
