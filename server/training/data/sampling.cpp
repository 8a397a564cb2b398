#include "server/training/data/sampling.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

namespace gatefield::training {
namespace {

/// guide_sdf() of common/geometry in single precision, cone angle kGuideConeAngle_rad.
class GuideField {
 public:
  explicit GuideField(const GateShape& shape)
      : inner_half_m_(static_cast<float>(shape.inner_half_m)), round_(shape.opening == GateShape::Opening::kRound) {}

  float operator()(const Eigen::Vector3f& p_G) const noexcept {
    const float transverse_m =
        round_ ? std::sqrt(p_G.y() * p_G.y() + p_G.z() * p_G.z()) : std::max(std::abs(p_G.y()), std::abs(p_G.z()));
    return half_width_m(p_G.x()) - transverse_m;
  }
  float half_width_m(float x_m) const noexcept { return inner_half_m_ + std::abs(x_m) * slope_; }
  bool round() const noexcept { return round_; }

 private:
  float inner_half_m_;
  bool round_;
  float slope_ = static_cast<float>(std::tan(kGuideConeAngle_rad));
};

float uniform(Random* random, float low, float high) {
  return low + (high - low) * static_cast<float>(random->bits() >> 8) * 0x1p-24f;
}

/// About normal, for spreading points only: the sum of four uniforms, scaled to unit variance; ends at 3.5 sigma.
float spread(Random* random) {
  const std::uint32_t a = random->bits();
  const std::uint32_t b = random->bits();
  const std::uint32_t sum = (a & 0xFFFFu) + (a >> 16) + (b & 0xFFFFu) + (b >> 16);
  return (static_cast<float>(sum) / 65536.0f - 2.0f) * 1.7320508f;
}

/// Point (y, z) of the unit square's or unit circle's edge, uniform along it.
Eigen::Vector2f on_edge(bool round, Random* random) {
  if (round) {
    const float angle_rad = uniform(random, 0.0f, 2.0f * std::numbers::pi_v<float>);
    return {std::cos(angle_rad), std::sin(angle_rad)};
  }
  const float along = uniform(random, -1.0f, 1.0f);
  switch (random->bits() >> 30) {
    case 0:
      return {1.0f, along};
    case 1:
      return {-1.0f, along};
    case 2:
      return {along, 1.0f};
    default:
      return {along, -1.0f};
  }
}

/// Uniform in the unit square or the unit disc.
Eigen::Vector2f inside(bool round, Random* random) {
  if (!round) return {uniform(random, -1.0f, 1.0f), uniform(random, -1.0f, 1.0f)};
  return on_edge(true, random) * std::sqrt(uniform(random, 0.0f, 1.0f));
}

struct FrustumSampler {
  explicit FrustumSampler(const CameraModel& camera)
      : x0(static_cast<float>(-camera.cx_px / camera.fx_px)),
        x1(static_cast<float>((camera.width_px - camera.cx_px) / camera.fx_px)),
        y0(static_cast<float>(-camera.cy_px / camera.fy_px)),
        y1(static_cast<float>((camera.height_px - camera.cy_px) / camera.fy_px)),
        z0(static_cast<float>(camera.min_depth_m)),
        z1(static_cast<float>(camera.max_depth_m)) {}

  Eigen::Vector3f operator()(Random* random) const {
    const float z_m = uniform(random, z0, z1);
    const float x = uniform(random, x0, x1);
    const float y = uniform(random, y0, y1);
    return {x * z_m, y * z_m, z_m};
  }
  float x0, x1, y0, y1, z0, z1;
};

}  // namespace

Status validate(const SamplingMix& mix) {
  const auto wrong = [](const char* field, double value, const char* expected) {
    return Error{std::string("sampling.") + field + " is " + std::to_string(value) + ", expected " + expected};
  };
  if (!(mix.near_surface >= 0)) return wrong("near_surface", mix.near_surface, "0 or more");
  if (!(mix.interior >= 0)) return wrong("interior", mix.interior, "0 or more");
  if (!(mix.collision >= 0)) return wrong("collision", mix.collision, "0 or more");
  if (!(mix.global >= 0)) return wrong("global", mix.global, "0 or more");
  const double sum = mix.near_surface + mix.interior + mix.collision + mix.global;
  if (!(sum > 0 && std::isfinite(sum)))
    return wrong("near_surface + interior + collision + global", sum, "more than 0");
  if (!(mix.reach_m > 0 && mix.reach_m <= 20)) return wrong("reach_m", mix.reach_m, "more than 0 and at most 20 m");
  if (!(mix.near_sigma_m > 0 && mix.near_sigma_m <= 5))
    return wrong("near_sigma_m", mix.near_sigma_m, "more than 0 and at most 5 m");
  if (!(mix.collision_margin_m >= 0 && mix.collision_margin_m <= 2))
    return wrong("collision_margin_m", mix.collision_margin_m, "0 to 2 m");
  return {};
}

void sample_points(const SamplingMix& mix, const CameraModel& camera, const GateShape& shape,
                   const Eigen::Isometry3f& X_CG, Random* random, std::span<float> points_C, std::span<float> sdf_m) {
  const std::size_t count = sdf_m.size();
  const double per_part = static_cast<double>(count) / (mix.near_surface + mix.interior + mix.collision + mix.global);
  const auto near_n = static_cast<std::size_t>(mix.near_surface * per_part + 1e-9);
  const auto interior_n = static_cast<std::size_t>(mix.interior * per_part + 1e-9);
  const auto collision_n = static_cast<std::size_t>(mix.collision * per_part + 1e-9);

  const GuideField field(shape);
  const auto reach_m = static_cast<float>(mix.reach_m);
  const auto sigma_m = static_cast<float>(mix.near_sigma_m);
  const auto margin_m = static_cast<float>(mix.collision_margin_m);
  const auto collision_half_x_m = static_cast<float>(0.5 * shape.thickness_m) + margin_m;
  const float collision_inner_m = std::max(static_cast<float>(shape.inner_half_m) - margin_m, 0.0f);
  const float collision_outer_m = static_cast<float>(shape.outer_half_m) + margin_m;

  std::size_t i = 0;
  const auto put = [&](const Eigen::Vector3f& p_C, float sdf) {
    points_C[3 * i] = p_C.x();
    points_C[3 * i + 1] = p_C.y();
    points_C[3 * i + 2] = p_C.z();
    sdf_m[i] = sdf;
    ++i;
  };
  const auto put_G = [&](const Eigen::Vector3f& p_G) { put(X_CG * p_G, field(p_G)); };

  for (const std::size_t end = near_n; i < end;) {
    const float x_m = uniform(random, -reach_m, reach_m);
    const float half_width_m = std::max(field.half_width_m(x_m) + sigma_m * spread(random), 0.0f);
    const Eigen::Vector2f edge = on_edge(field.round(), random) * half_width_m;
    put_G({x_m, edge.x(), edge.y()});
  }
  for (const std::size_t end = near_n + interior_n; i < end;) {
    const float x_m = uniform(random, -reach_m, reach_m);
    const Eigen::Vector2f across = inside(field.round(), random) * field.half_width_m(x_m);
    put_G({x_m, across.x(), across.y()});
  }
  for (const std::size_t end = near_n + interior_n + collision_n; i < end;) {
    const float x_m = uniform(random, -collision_half_x_m, collision_half_x_m);
    // Uniform in the area between the two edges: the area inside half-width r grows with r^2.
    const float inner2 = collision_inner_m * collision_inner_m;
    const float outer2 = collision_outer_m * collision_outer_m;
    const float half_width_m = std::sqrt(uniform(random, inner2, outer2));
    const Eigen::Vector2f across = on_edge(field.round(), random) * half_width_m;
    put_G({x_m, across.x(), across.y()});
  }
  const FrustumSampler frustum(camera);
  const Eigen::Isometry3f X_GC = X_CG.inverse();
  while (i < count) {
    const Eigen::Vector3f p_C = frustum(random);
    put(p_C, field(X_GC * p_C));
  }
}

void sample_box(double half_m, const GateShape& shape, const Eigen::Isometry3f& X_CG, Random* random,
                std::span<float> points_C, std::span<float> sdf_m) {
  const GuideField field(shape);
  const auto half = static_cast<float>(half_m);
  for (std::size_t i = 0; i < sdf_m.size(); ++i) {
    const float x_m = uniform(random, -half, half);
    const float y_m = uniform(random, -half, half);
    const Eigen::Vector3f p_G(x_m, y_m, uniform(random, -half, half));
    const Eigen::Vector3f p_C = X_CG * p_G;
    std::copy_n(p_C.data(), 3, points_C.data() + 3 * i);
    sdf_m[i] = field(p_G);
  }
}

void sample_frustum(const CameraModel& camera, Random* random, std::span<float> points_C) {
  const FrustumSampler frustum(camera);
  for (std::size_t i = 0; i + 2 < points_C.size(); i += 3) {
    const Eigen::Vector3f p_C = frustum(random);
    std::copy_n(p_C.data(), 3, points_C.data() + i);
  }
}

}  // namespace gatefield::training
