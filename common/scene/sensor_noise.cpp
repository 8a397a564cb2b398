#include "common/scene/sensor_noise.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>

#include "common/base/multiversion.h"
#include "common/scene/noise_planes.h"

namespace gatefield::scene {
namespace {

/// Buffers that keep their size between calls, one set per thread.
struct Scratch {
  std::vector<std::uint32_t> bits;
  std::vector<float> normals;
  std::vector<float> disturbed_m;
  std::vector<float> second_px;
  std::vector<std::uint8_t> edge;
};

/// disturbed = D / quantised(D / z + sigma n), 0 when there was nothing or when it leaves the range. D = fx b.
GATEFIELD_MULTIVERSION void disturb(const float* z_m, const float* normals, std::size_t pixels, float disparity_m_px,
                                    float sigma_px, float step_px, float min_m, float max_m, float* disturbed_m) {
  const float per_step = 1.0f / step_px;
  for (std::size_t i = 0; i < pixels; ++i) {
    const float disparity_px = disparity_m_px / std::max(z_m[i], 1e-3f) + sigma_px * normals[i];
    // Rounded half up through an integer; disparities that are negative or do not fit are out of range anyway.
    const float steps = std::min(std::max(disparity_px * per_step + 0.5f, 0.0f), 2e9f);
    const float quantised_px = static_cast<float>(static_cast<std::int32_t>(steps)) * step_px;
    const float measured_m = disparity_m_px / std::max(quantised_px, 1e-6f);
    const bool good = (z_m[i] > 0.0f) & (measured_m >= min_m) & (measured_m <= max_m);
    disturbed_m[i] = good ? measured_m : 0.0f;
  }
}

inline bool differs(float z_m, float other_m) noexcept { return std::abs(other_m - z_m) > 0.1f + 0.03f * z_m; }

/// edge[u] = 1 where the true depth of a neighbour in the row or in the rows above and below differs;
/// second_px[u] = where the second imager sees the pixel's point.
GATEFIELD_MULTIVERSION void examine_row(const float* row_m, const float* above_m, const float* below_m, int width,
                                        float disparity_m_px, std::uint8_t* edge, float* second_px) {
  for (int u = 0; u < width; ++u) {
    edge[u] = static_cast<std::uint8_t>(differs(row_m[u], above_m[u]) | differs(row_m[u], below_m[u]));
    second_px[u] = static_cast<float>(u) - disparity_m_px / std::max(row_m[u], 1e-3f);
  }
  for (int u = 1; u < width; ++u) edge[u] = static_cast<std::uint8_t>(edge[u] | differs(row_m[u], row_m[u - 1]));
  for (int u = 0; u + 1 < width; ++u) edge[u] = static_cast<std::uint8_t>(edge[u] | differs(row_m[u], row_m[u + 1]));
}

/// Loss and wrong matches from one uniform number of 20 bits: what survives is [0, keep), of which [0, keep speckle) is
/// wrong.
GATEFIELD_MULTIVERSION void lose(const float* cosine, const float* reflectance, const std::uint32_t* bits_a,
                                 const std::uint32_t* bits_b, std::size_t pixels, float incidence, float black,
                                 float speckle, float min_m, float max_m, float* depth_m) {
  constexpr float kToUnit = 1.0f / 1048576.0f;  // 2^-20
  for (std::size_t i = 0; i < pixels; ++i) {
    const float slant = 1.0f - cosine[i];
    const float darkness = 1.0f - reflectance[i];
    const float keep_incidence = std::max(1.0f - incidence * slant * slant * slant, 0.0f);
    const float keep_black = std::max(1.0f - black * darkness * darkness * darkness, 0.0f);
    const float keep = keep_incidence * keep_black;
    const float draw = static_cast<float>(static_cast<std::int32_t>(bits_a[i] >> 12)) * kToUnit;
    const float where = static_cast<float>(static_cast<std::int32_t>(bits_b[i] & 0xFFFFFu)) * kToUnit;
    const float value = draw < keep * speckle ? min_m + (max_m - min_m) * where : depth_m[i];
    depth_m[i] = (draw < keep) & (depth_m[i] > 0.0f) ? value : 0.0f;
  }
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
    return Error::invalid(std::string("noise.") + field, std::to_string(value), expected);
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
  return noise.active_stereo ? validate(*noise.active_stereo) : Status{};
}

CameraModel rendered_camera(const SensorNoise& noise, const CameraModel& camera) {
  CameraModel rendered = camera;
  if (noise.active_stereo && noise.scale > 0.0)
    rendered.max_depth_m = std::max(camera.max_depth_m, noise.active_stereo->render_to_m);
  return rendered;
}

SensorNoise one_sensor(const SensorNoise& noise, std::uint64_t seed) {
  SensorNoise one = noise;
  if (!one.active_stereo) return one;
  Random random(seed, Stream("gatefield.depth_scale"));
  ActiveStereoNoise& stereo = *one.active_stereo;
  stereo.depth_scale_min = stereo.depth_scale_max = random.uniform(stereo.depth_scale_min, stereo.depth_scale_max);
  return one;
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
  if (noise.active_stereo) {
    apply_active_stereo(*noise.active_stereo, noise.scale, camera, clean, surface, key, noisy);
    return;
  }

  static thread_local Scratch scratch;
  const std::size_t blocks = (pixels + 1) / 2;
  scratch.bits.resize(4 * blocks);
  scratch.normals.resize(pixels);
  scratch.disturbed_m.resize(pixels);
  scratch.second_px.resize(static_cast<std::size_t>(width));
  scratch.edge.resize(static_cast<std::size_t>(width));
  // 12 bits: disparity noise; 20 bits: loss and speckle.
  std::uint32_t* const bits_a = scratch.bits.data();
  // 12 bits bleed, 2 which neighbour, 6 mixture, 12 shadow; 20: wrong depth.
  std::uint32_t* const bits_b = bits_a + 2 * blocks;
  fill_bits(key[0], key[1], 0, blocks, bits_a, bits_a + blocks, bits_b, bits_b + blocks);

  const auto min_m = static_cast<float>(camera.min_depth_m);
  const auto max_m = static_cast<float>(camera.max_depth_m);
  const auto disparity_m_px = static_cast<float>(camera.fx_px * noise.baseline_m);  // disparity = this / z
  const float* const z_m = clean.depth_m.data();
  float* const disturbed_m = scratch.disturbed_m.data();
  float* const out_m = noisy->depth_m.data();

  // 1. Disparity noise and quantisation: sigma_z = z^2 / (fx b) sigma_d.
  const float* const table = normal_table().data();
  for (std::size_t i = 0; i < pixels; ++i) scratch.normals[i] = table[bits_a[i] & (kNormals - 1)];
  disturb(z_m, scratch.normals.data(), pixels, disparity_m_px,
          static_cast<float>(noise.disparity_noise_px * width / 160.0) * scale,
          std::max(static_cast<float>(noise.disparity_step_px) * scale, 1e-6f), min_m, max_m, disturbed_m);

  // 2. Edges and shadows. A pixel is in shadow when the second imager, baseline_m to the right, sees something nearer
  //    on the same line of sight: scanning from right to left, its position there is not left of all those before it.
  const std::uint32_t bleed = threshold(noise.bleed_probability * noise.scale, 4096.0);
  const std::uint32_t shadow = threshold(noise.shadow_probability * noise.scale, 4096.0);
  for (int v = 0; v < height; ++v) {
    const std::size_t row = static_cast<std::size_t>(v) * width;
    const std::size_t above = v > 0 ? row - width : row;
    const std::size_t below = v + 1 < height ? row + width : row;
    examine_row(z_m + row, z_m + above, z_m + below, width, disparity_m_px, scratch.edge.data(),
                scratch.second_px.data());
    float leftmost_px = 1e9f;
    for (int u = width - 1; u >= 0; --u) {
      const std::size_t i = row + u;
      if (z_m[i] <= 0.0f) {
        out_m[i] = 0.0f;
        continue;
      }
      float result_m = disturbed_m[i];
      const std::uint32_t draw = bits_b[i];
      if (scratch.edge[static_cast<std::size_t>(u)] != 0 && (draw & 4095u) < bleed) {
        // Start at a random neighbour and take the first one across the edge; half of the time wholly, else in part.
        const std::size_t neighbours[4] = {u > 0 ? i - 1 : i, u + 1 < width ? i + 1 : i, above + u, below + u};
        std::uint32_t pick = (draw >> 12) & 3u;
        while (!differs(z_m[i], z_m[neighbours[pick]])) pick = (pick + 1) & 3u;
        const float other_m = disturbed_m[neighbours[pick]];
        const std::uint32_t mixture = (draw >> 14) & 63u;
        if (result_m <= 0.0f || other_m <= 0.0f || mixture >= 32) {
          result_m = other_m;
        } else {
          result_m += (other_m - result_m) * (static_cast<float>(mixture) + 0.5f) / 32.0f;
        }
      }
      const float second_px = scratch.second_px[static_cast<std::size_t>(u)];
      if (second_px >= leftmost_px) {
        if ((draw >> 20) < shadow) result_m = 0.0f;
      } else {
        leftmost_px = second_px;
      }
      out_m[i] = result_m;
    }
  }

  // 3. Holes, from a stream of their own: their number varies.
  Random holes((std::uint64_t{key[1]} << 32) | key[0], 1);
  const int count = noise.hole_radius_px > 0.0 ? poisson(noise.hole_rate_per_image * noise.scale, &holes) : 0;
  for (int hole = 0; hole < count; ++hole) punch_hole(noise.hole_radius_px, width, height, &holes, out_m);

  // 4. Loss by incidence and reflectance, and wrong matches.
  lose(surface.cos_incidence.data(), surface.reflectance.data(), bits_a, bits_b, pixels,
       static_cast<float>(noise.incidence_loss) * scale, static_cast<float>(noise.reflectance_loss) * scale,
       std::min(static_cast<float>(noise.speckle_probability) * scale, 1.0f), min_m, max_m, out_m);
}

}  // namespace gatefield::scene
