#include "server/training/data/dataset.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>

#include "common/base/multiversion.h"
#include "server/training/data/fill.h"
#include "server/training/data/sampling.h"
#include "server/training/data/scenes.h"

namespace gatefield::training {
namespace {

using Eigen::Isometry3d;

std::uint8_t pack_surface(float cosine, float reflectance) {
  const auto high = static_cast<unsigned>(cosine * 15.0f + 0.5f);
  const auto low = static_cast<unsigned>(reflectance * 15.0f + 0.5f);
  return static_cast<std::uint8_t>(std::min(high, 15u) << 4 | std::min(low, 15u));
}

/// Valid gates first, nearer ones first within each kind.
bool comes_before(const GateLabel& a, const GateLabel& b) {
  if (a.valid() != b.valid()) return a.valid();
  return a.p_CG.squaredNorm() < b.p_CG.squaredNorm();
}

template <typename AnySample>
void sort(AnySample* sample) {
  const auto begin = sample->gates.begin();
  const auto end = begin + sample->gate_count;
  std::sort(begin, end, comes_before);
  sample->valid_count = static_cast<int>(std::count_if(begin, end, [](const GateLabel& gate) { return gate.valid(); }));
}

}  // namespace

const CameraModel& dataset_camera() {
  static const CameraModel camera = default_camera();
  return camera;
}

float visible_fraction(const CameraModel& camera, std::span<const std::uint16_t> clean_mm, const GateShape& shape,
                       const Eigen::Isometry3f& X_CG) {
  constexpr int kPoints = 64;
  constexpr float kTolerance_m = 0.15f;
  const auto middle_m = static_cast<float>(0.5 * (shape.inner_half_m + shape.outer_half_m));
  int seen = 0;
  for (int k = 0; k < kPoints; ++k) {
    Eigen::Vector3f p_G;
    if (shape.opening == GateShape::Opening::kRound) {
      const float angle_rad = 2.0f * std::numbers::pi_v<float> * static_cast<float>(k) / kPoints;
      p_G = {0.0f, middle_m * std::cos(angle_rad), middle_m * std::sin(angle_rad)};
    } else {
      constexpr int kPerSide = kPoints / 4;
      const int side = k / kPerSide;
      const float along_m = middle_m * (2.0f * (static_cast<float>(k % kPerSide) + 0.5f) / kPerSide - 1.0f);
      const float across_m = side < 2 ? middle_m : -middle_m;
      p_G = side % 2 == 0 ? Eigen::Vector3f(0.0f, across_m, along_m) : Eigen::Vector3f(0.0f, along_m, across_m);
    }
    const Eigen::Vector3f p_C = X_CG * p_G;
    if (!camera.sees(p_C.cast<double>())) continue;
    const auto u = static_cast<int>(camera.fx_px * p_C.x() / p_C.z() + camera.cx_px);
    const auto v = static_cast<int>(camera.fy_px * p_C.y() / p_C.z() + camera.cy_px);
    const float shown_m = 0.001f * static_cast<float>(clean_mm[static_cast<std::size_t>(v * camera.width_px + u)]);
    if (shown_m > 0.0f && std::abs(shown_m - p_C.z()) <= kTolerance_m) ++seen;
  }
  return static_cast<float>(seen) / kPoints;
}

Sample generate(std::uint64_t seed, std::uint64_t index, double round_part, const CameraModel& rendered) {
  const CameraModel& camera = dataset_camera();
  Random random(seed, index);
  const Scenario scenario = draw_scenario(camera, &random, {.round_part = round_part});

  static thread_local scene::DepthImage image;
  static thread_local scene::SurfaceImage surface;
  scene::DepthCamera(scenario.world).render(rendered, scenario.X_WC, &image, &surface);

  Sample sample;
  sample.clean_mm.resize(kImageSize_px);
  sample.surface.resize(kImageSize_px);
  for (std::size_t i = 0; i < kImageSize_px; ++i) {
    sample.clean_mm[i] = static_cast<std::uint16_t>(image.depth_m[i] * 1000.0f + 0.5f);
    sample.surface[i] = pack_surface(surface.cos_incidence[i], surface.reflectance[i]);
  }
  const Isometry3d X_CW = scenario.X_WC.inverse();
  sample.gate_count = static_cast<int>(std::min<std::size_t>(scenario.gates, kMaxGates));
  for (std::size_t i = 0; i < static_cast<std::size_t>(sample.gate_count); ++i) {
    const Isometry3d X_CG = X_CW * scenario.world.gates[i].X_WG;
    GateLabel& label = sample.gates[i];
    label.p_CG = X_CG.translation().cast<float>();
    label.q_CG = Eigen::Quaterniond(X_CG.linear()).normalized().cast<float>();
    label.shape = scenario.world.gates[i].shape;
    label.visible_fraction = visible_fraction(camera, sample.clean_mm, label.shape, label.X_CG());
  }
  sample.X_WC = scenario.X_WC.cast<float>();
  sort_gates(&sample);
  return sample;
}

void sort_gates(Sample* sample) { sort(sample); }
void sort_gates(SampleView* sample) { sort(sample); }

void set_gates(std::vector<GateLabel> gates, Sample* sample) {
  std::ranges::stable_sort(gates, comes_before);
  sample->gate_count = static_cast<int>(std::min<std::size_t>(gates.size(), kMaxGates));
  std::copy_n(gates.begin(), sample->gate_count, sample->gates.begin());
  sort_gates(sample);
}

void frame_mask(const SampleView& sample, const GateLabel& gate, std::span<std::uint8_t> mask) {
  constexpr float kGrow_m = 0.03f;
  const CameraModel& camera = dataset_camera();
  const Eigen::Matrix3f R_GC = gate.q_CG.conjugate().toRotationMatrix();
  const Eigen::Vector3f p_GC = -(R_GC * gate.p_CG);
  const float half_x_m = static_cast<float>(0.5 * gate.shape.thickness_m) + kGrow_m;
  const float inner_m = static_cast<float>(gate.shape.inner_half_m) - kGrow_m;
  const float outer_m = static_cast<float>(gate.shape.outer_half_m) + kGrow_m;
  const bool round = gate.shape.opening == GateShape::Opening::kRound;
  const std::span<const std::uint16_t> depth_mm = sample.reference_mm();
  for (int v = 0; v < kImageHeight_px; ++v) {
    const auto ray_y = static_cast<float>((v + 0.5 - camera.cy_px) / camera.fy_px);
    for (int u = 0; u < kImageWidth_px; ++u) {
      const auto i = static_cast<std::size_t>(v * kImageWidth_px + u);
      const auto ray_x = static_cast<float>((u + 0.5 - camera.cx_px) / camera.fx_px);
      const float z_m = 0.001f * static_cast<float>(depth_mm[i]);
      const Eigen::Vector3f p_G = z_m * (ray_x * R_GC.col(0) + ray_y * R_GC.col(1) + R_GC.col(2)) + p_GC;
      const float transverse_m = round ? std::hypot(p_G.y(), p_G.z()) : std::max(std::abs(p_G.y()), std::abs(p_G.z()));
      const bool on_frame =
          z_m > 0.0f && std::abs(p_G.x()) <= half_x_m && transverse_m >= inner_m && transverse_m <= outer_m;
      mask[i] = on_frame ? 1 : 0;
    }
  }
}

namespace {

GATEFIELD_MULTIVERSION void to_metres(const std::uint16_t* depth_mm, float* depth_m) {
  for (std::size_t i = 0; i < kImageSize_px; ++i) depth_m[i] = 0.001f * static_cast<float>(depth_mm[i]);
}

/// What was rendered for the noise's sake alone.
GATEFIELD_MULTIVERSION void drop_beyond(float farthest_m, float* depth_m) {
  for (std::size_t i = 0; i < kImageSize_px; ++i) depth_m[i] = depth_m[i] <= farthest_m ? depth_m[i] : 0.0f;
}

GATEFIELD_MULTIVERSION void unpack_surface(const std::uint8_t* surface, float* cosine, float* reflectance) {
  for (std::size_t i = 0; i < kImageSize_px; ++i) {
    cosine[i] = static_cast<float>(surface[i] >> 4) * (1.0f / 15.0f);
    reflectance[i] = static_cast<float>(surface[i] & 15) * (1.0f / 15.0f);
  }
}

}  // namespace

void draw_clean(const SampleView& sample, std::span<float> clean_m) {
  if (sample.clean_mm.empty()) {
    std::fill_n(clean_m.begin(), kImageSize_px, 0.0f);
    return;
  }
  to_metres(sample.clean_mm.data(), clean_m.data());
  drop_beyond(static_cast<float>(dataset_camera().max_depth_m) + 5e-4f, clean_m.data());
}

void draw_noisy(const SampleView& sample, const scene::SensorNoise& noise, Random* random, std::span<float> noisy_m) {
  if (!sample.measured_mm.empty()) {
    to_metres(sample.measured_mm.data(), noisy_m.data());
    return;
  }
  static thread_local scene::DepthImage clean;
  static thread_local scene::SurfaceImage surface;
  static thread_local scene::DepthImage noisy;
  clean.width_px = kImageWidth_px;
  clean.height_px = kImageHeight_px;
  clean.depth_m.resize(kImageSize_px);
  surface.cos_incidence.resize(kImageSize_px);
  surface.reflectance.resize(kImageSize_px);
  to_metres(sample.clean_mm.data(), clean.depth_m.data());
  unpack_surface(sample.surface.data(), surface.cos_incidence.data(), surface.reflectance.data());
  scene::apply_noise(noise, dataset_camera(), clean, surface, random, &noisy);
  std::copy_n(noisy.depth_m.begin(), kImageSize_px, noisy_m.begin());
}

namespace {

/// Query points that are stored with a sample; a stream of their own, so that the images don't depend on them.
void add_points(std::uint64_t seed, std::uint64_t index, int points, Sample* sample) {
  constexpr std::uint64_t kStream = std::uint64_t{1} << 63;
  Random random(seed, kStream + index);
  sample->points_C.resize(3 * static_cast<std::size_t>(points));
  sample->sdf_m.resize(static_cast<std::size_t>(points));
  if (sample->valid_count == 0) {
    sample_frustum(dataset_camera(), &random, sample->points_C);
    std::fill(sample->sdf_m.begin(), sample->sdf_m.end(), std::numeric_limits<float>::quiet_NaN());
    return;
  }
  const GateLabel& target = sample->gates[0];
  sample_points(SamplingMix{}, dataset_camera(), target.shape, target.X_CG(), &random, sample->points_C, sample->sdf_m);
}

}  // namespace

Status generate_dataset(const std::filesystem::path& file, const DatasetOptions& options,
                        const std::function<bool(const Progress&)>& progress) {
  DatasetInfo info;
  info.kind = DatasetKind::kSimulation;
  info.seed = options.seed;
  info.first_index = options.first_index;
  info.note = "generated by gatefield-train, scenes " + std::to_string(kScenesVersion);
  info.round_part = options.round_part;
  DatasetColumns columns;
  columns.X_WC = true;
  columns.points = options.points;
  const auto make = [&](std::uint64_t done, std::uint64_t job, std::vector<Sample>* samples) {
    if (done + job >= options.count) return;
    const std::uint64_t index = options.first_index + done + job;
    samples->push_back(generate(options.seed, index, options.round_part));
    if (options.points > 0) add_points(options.seed, index, options.points, &samples->back());
  };
  return fill_dataset(file, {info, columns, options.count, 256, options.threads, make}, progress);
}

}  // namespace gatefield::training
