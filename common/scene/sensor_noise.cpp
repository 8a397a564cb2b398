#include "common/scene/sensor_noise.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <span>
#include <string>

namespace gatefield::scene {
namespace {

constexpr std::uint32_t kNormalBits = 12;
constexpr std::size_t kNormals = std::size_t{1} << kNormalBits;

/// Standard normal quantiles, indexed by random bits: a normal number for the price of a look-up (tails end at 3.7
/// sigma). Each entry is the inverse of the distribution function at the middle of its slice, by bisection; scaled to
/// variance 1.
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

/// Buffers that keep their size between calls, one set per thread.
struct Scratch {
  std::vector<std::uint32_t> bits;
  std::vector<float> disturbed_m;
};

/// bits[plane * count + i]: four independent planes of 32 random bits per four pixels, laid out so that the loop
/// vectorises.
void fill_bits(const std::array<std::uint32_t, 2>& key, std::span<std::uint32_t> bits) {
  const std::size_t blocks = bits.size() / 4;
  std::uint32_t* const plane0 = bits.data();
  std::uint32_t* const plane1 = plane0 + blocks;
  std::uint32_t* const plane2 = plane1 + blocks;
  std::uint32_t* const plane3 = plane2 + blocks;
  for (std::size_t i = 0; i < blocks; ++i) {
    const auto block = philox({static_cast<std::uint32_t>(i), 0, 0, 0}, key);
    plane0[i] = block[0];
    plane1[i] = block[1];
    plane2[i] = block[2];
    plane3[i] = block[3];
  }
}

/// Poisson number by Knuth's product of uniforms; fine for the few holes of an image.
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

void punch_hole(double mean_radius_px, int width, int height, Random* random, float* depth_m) {
  const double radius_px = mean_radius_px * random->uniform(0.4, 1.6);
  const double stretch = std::exp(random->uniform(-0.7, 0.7));
  const double angle_rad = random->uniform(0.0, std::numbers::pi);
  const double center_u = random->uniform(0.0, width);
  const double center_v = random->uniform(0.0, height);
  const double a_px = radius_px * stretch;
  const double b_px = radius_px / stretch;
  const double reach_px = std::max(a_px, b_px);
  const double cosine = std::cos(angle_rad);
  const double sine = std::sin(angle_rad);
  const int v_end = std::min(height, static_cast<int>(center_v + reach_px) + 1);
  const int u_end = std::min(width, static_cast<int>(center_u + reach_px) + 1);
  for (int v = std::max(0, static_cast<int>(center_v - reach_px)); v < v_end; ++v) {
    for (int u = std::max(0, static_cast<int>(center_u - reach_px)); u < u_end; ++u) {
      const double du = u + 0.5 - center_u;
      const double dv = v + 0.5 - center_v;
      const double along = (cosine * du + sine * dv) / a_px;
      const double across = (cosine * dv - sine * du) / b_px;
      if (along * along + across * across < 1.0) depth_m[static_cast<std::size_t>(v) * width + u] = 0.0f;
    }
  }
}

std::uint32_t threshold(double probability, double range) {
  return static_cast<std::uint32_t>(std::clamp(probability, 0.0, 1.0) * range);
}

}  // namespace

Status validate(const SensorNoise& noise) {
  const auto check = [](const char* field, double value, double low, double high, const char* expected) -> Status {
    if (value >= low && value <= high) return {};
    return Error{std::string("noise.") + field + " is " + std::to_string(value) + ", expected " + expected};
  };
  for (const Status& status : {check("baseline_m", noise.baseline_m, 0.005, 1.0, "0.005 to 1 m"),
                               check("disparity_noise_px", noise.disparity_noise_px, 0.0, 10.0, "0 to 10 px"),
                               check("disparity_step_px", noise.disparity_step_px, 0.0, 2.0, "0 to 2 px"),
                               check("bleed_probability", noise.bleed_probability, 0.0, 1.0, "0 to 1"),
                               check("shadow_probability", noise.shadow_probability, 0.0, 1.0, "0 to 1"),
                               check("hole_rate_per_image", noise.hole_rate_per_image, 0.0, 100.0, "0 to 100"),
                               check("hole_radius_px", noise.hole_radius_px, 0.0, 100.0, "0 to 100 px"),
                               check("speckle_probability", noise.speckle_probability, 0.0, 1.0, "0 to 1"),
                               check("incidence_loss", noise.incidence_loss, 0.0, 1.0, "0 to 1"),
                               check("reflectance_loss", noise.reflectance_loss, 0.0, 1.0, "0 to 1"),
                               check("scale", noise.scale, 0.0, 10.0, "0 to 10")}) {
    if (!status.ok()) return status;
  }
  return {};
}

void apply_noise(const SensorNoise& noise, const CameraModel& camera, const DepthImage& clean,
                 const SurfaceImage& surface, Random* random, DepthImage* noisy) {
  const int width = clean.width_px;
  const int height = clean.height_px;
  const std::size_t pixels = clean.depth_m.size();
  noisy->width_px = width;
  noisy->height_px = height;
  noisy->depth_m.resize(pixels);

  // The stream moves by the same amount whatever the image holds, so that later draws do not depend on it.
  const std::array<std::uint32_t, 2> key{random->bits(), random->bits()};
  const auto scale = static_cast<float>(noise.scale);
  if (noise.scale <= 0.0) {
    noisy->depth_m = clean.depth_m;
    return;
  }

  static thread_local Scratch scratch;
  const std::size_t blocks = (2 * pixels + 3) / 4;
  scratch.bits.resize(4 * blocks);
  scratch.disturbed_m.resize(pixels);
  fill_bits(key, scratch.bits);
  const std::uint32_t* const bits_a = scratch.bits.data();  // 12 bits: disparity noise; 20 bits: loss and speckle
  const std::uint32_t* const bits_b =
      scratch.bits.data() + 2 * blocks;  // 12 bits bleed, 2 which neighbour, 6 mixture, 12 shadow

  const auto min_m = static_cast<float>(camera.min_depth_m);
  const auto max_m = static_cast<float>(camera.max_depth_m);
  const auto disparity_m_px = static_cast<float>(camera.fx_px * noise.baseline_m);  // disparity = this / z
  const float* const z_m = clean.depth_m.data();
  float* const disturbed_m = scratch.disturbed_m.data();
  float* const out_m = noisy->depth_m.data();

  // 1. Disparity noise and quantisation, sigma_z = z^2 / (fx b) sigma_d. A depth pushed out of the range is lost.
  {
    const auto sigma_px = static_cast<float>(noise.disparity_noise_px * width / 160.0) * scale;
    const float step_px = std::max(static_cast<float>(noise.disparity_step_px) * scale, 1e-6f);
    const float per_step = 1.0f / step_px;
    const float* const normals = normal_table().data();
    for (std::size_t i = 0; i < pixels; ++i) {
      const float z = z_m[i];
      const float disparity_px = disparity_m_px / std::max(z, 1e-3f) + sigma_px * normals[bits_a[i] & (kNormals - 1)];
      // Round half up through an integer: positive disparities below 2^31 steps, others are lost anyway.
      const float steps = std::clamp(disparity_px * per_step + 0.5f, 0.0f, 2e9f);
      const float quantised_px = static_cast<float>(static_cast<std::int32_t>(steps)) * step_px;
      const float measured_m = disparity_m_px / std::max(quantised_px, 1e-6f);
      const bool good = z > 0.0f && measured_m >= min_m && measured_m <= max_m;
      disturbed_m[i] = good ? measured_m : 0.0f;
    }
  }

  // 2. Edges and shadows. A pixel is at an edge when a neighbour's true depth differs by more than 0.1 m + 3 %, or has
  // none.
  //    It is in shadow when the second imager, baseline_m to the right, sees something nearer on the same line of
  //    sight: scanning from right to left, its position u - disparity there is not left of all those before it.
  {
    const std::uint32_t bleed = threshold(noise.bleed_probability * noise.scale, 4096.0);
    const std::uint32_t shadow = threshold(noise.shadow_probability * noise.scale, 4096.0);
    const auto differs = [](float z, float other) { return std::abs(other - z) > 0.1f + 0.03f * z; };
    for (int v = 0; v < height; ++v) {
      const std::size_t row = static_cast<std::size_t>(v) * width;
      const std::size_t up = v > 0 ? row - width : row;
      const std::size_t down = v + 1 < height ? row + width : row;
      float leftmost_px = 1e9f;
      for (int u = width - 1; u >= 0; --u) {
        const std::size_t i = row + u;
        const float z = z_m[i];
        if (z <= 0.0f) {
          out_m[i] = 0.0f;
          continue;
        }
        float result_m = disturbed_m[i];
        const std::size_t neighbours[4] = {u > 0 ? i - 1 : i, u + 1 < width ? i + 1 : i, up + u, down + u};
        const bool edge = differs(z, z_m[neighbours[0]]) || differs(z, z_m[neighbours[1]]) ||
                          differs(z, z_m[neighbours[2]]) || differs(z, z_m[neighbours[3]]);
        const std::uint32_t draw = bits_b[i];
        if (edge && (draw & 4095u) < bleed) {
          // Start at a random neighbour and take the first one across the edge; half of the time wholly, else in part.
          std::uint32_t pick = (draw >> 12) & 3u;
          while (!differs(z, z_m[neighbours[pick]])) pick = (pick + 1) & 3u;
          const float other_m = disturbed_m[neighbours[pick]];
          const std::uint32_t mixture = (draw >> 14) & 63u;
          if (result_m <= 0.0f || other_m <= 0.0f || mixture >= 32) {
            result_m = other_m;
          } else {
            result_m += (other_m - result_m) * (static_cast<float>(mixture) + 0.5f) / 32.0f;
          }
        }
        const float second_px = static_cast<float>(u) - disparity_m_px / z;
        if (second_px >= leftmost_px) {
          if ((draw >> 20) < shadow) result_m = 0.0f;
        } else {
          leftmost_px = second_px;
        }
        out_m[i] = result_m;
      }
    }
  }

  // 3. Holes, from a stream of their own: their number varies.
  {
    Random holes((std::uint64_t{key[1]} << 32) | key[0], 1);
    const int count = noise.hole_radius_px > 0.0 ? poisson(noise.hole_rate_per_image * noise.scale, &holes) : 0;
    for (int hole = 0; hole < count; ++hole) punch_hole(noise.hole_radius_px, width, height, &holes, out_m);
  }

  // 4. Loss by incidence and reflectance, and wrong matches, from one uniform number: [0, lost) is lost, [lost, lost +
  // speckle)
  //    of what remains is a wrong match.
  {
    const float incidence = static_cast<float>(noise.incidence_loss) * scale;
    const float black = static_cast<float>(noise.reflectance_loss) * scale;
    const float speckle = std::min(static_cast<float>(noise.speckle_probability) * scale, 1.0f);
    const float* const cosine = surface.cos_incidence.data();
    const float* const reflectance = surface.reflectance.data();
    constexpr float kRange = 1048576.0f;  // 2^20
    for (std::size_t i = 0; i < pixels; ++i) {
      const float keep_incidence = std::max(1.0f - incidence * (1.0f - cosine[i]), 0.0f);
      const float keep_black = std::max(1.0f - black * (1.0f - reflectance[i]), 0.0f);
      const float keep = keep_incidence * keep_black;
      const float draw = static_cast<float>(bits_a[i] >> 12) / kRange;
      const float wrong_m = min_m + (max_m - min_m) * static_cast<float>(bits_b[i] & 0xFFFFFu) / kRange;
      const float value = draw < keep * speckle ? wrong_m : out_m[i];
      out_m[i] = draw < keep && out_m[i] > 0.0f ? value : 0.0f;
    }
  }
}

}  // namespace gatefield::scene
