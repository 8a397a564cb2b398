#include "server/training/learn/batches.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/base/random.h"

namespace gatefield::training {
namespace {

// Streams of the generator: every use has its own, so that changing one leaves the others as they are.
constexpr std::uint64_t kImageStream = 1ull << 40;
constexpr std::uint64_t kCropStream = 2ull << 40;

/// The mirrored image's gate: x of the camera turned round; the gate's y as well, so that its axes stay right-handed.
GateLabel mirrored(const GateLabel& gate) {
  GateLabel out = gate;
  out.p_CG.x() = -gate.p_CG.x();
  const Eigen::Matrix3f mirror_C = Eigen::Vector3f(-1.0f, 1.0f, 1.0f).asDiagonal();
  const Eigen::Matrix3f mirror_G = Eigen::Vector3f(1.0f, -1.0f, 1.0f).asDiagonal();
  const Eigen::Matrix3f R = mirror_C * gate.q_CG.toRotationMatrix() * mirror_G;
  out.q_CG = Eigen::Quaternionf(R).normalized();
  return out;
}

template <typename T>
void mirror_rows(std::span<T> image) {
  for (int v = 0; v < kImageHeight_px; ++v) {
    const auto row = image.subspan(static_cast<std::size_t>(v) * kImageWidth_px, kImageWidth_px);
    std::reverse(row.begin(), row.end());
  }
}

void set_target(const GateLabel* gate, float weight, float validity, float validity_weight, std::size_t at,
                Batch* batch) {
  batch->validity[at] = validity;
  batch->validity_weight[at] = validity_weight;
  batch->target_weight[at] = weight;
  if (gate == nullptr) {
    for (std::size_t i = 0; i < 3; ++i) batch->target_center[3 * at + i] = 0.0f;
    for (std::size_t i = 0; i < 6; ++i) batch->target_normal[6 * at + i] = 0.0f;
    return;
  }
  const Eigen::Vector3f normal = gate->q_CG * Eigen::Vector3f::UnitX();
  for (std::size_t i = 0; i < 3; ++i) {
    batch->target_center[3 * at + i] = gate->p_CG[static_cast<Eigen::Index>(i)];
    batch->target_normal[6 * at + i] = normal[static_cast<Eigen::Index>(i)] * normal[static_cast<Eigen::Index>(i)];
  }
  batch->target_normal[6 * at + 3] = normal.x() * normal.y();
  batch->target_normal[6 * at + 4] = normal.x() * normal.z();
  batch->target_normal[6 * at + 5] = normal.y() * normal.z();
}

void set_points(const BatchOptions& options, const GateLabel* gate, std::size_t at, Random* random, Batch* batch) {
  const auto count = static_cast<std::size_t>(options.points);
  const std::span points_C(batch->points_C.data() + 3 * count * at, 3 * count);
  const std::span sdf_m(batch->sdf_m.data() + count * at, count);
  if (gate == nullptr) {
    std::fill(points_C.begin(), points_C.end(), 0.0f);
    std::fill(sdf_m.begin(), sdf_m.end(), 0.0f);
    return;
  }
  sample_points(SamplingMix{}, dataset_camera(), gate->shape, gate->X_CG(), random, points_C, sdf_m);
}

float loss_weight(const GateLabel& gate) { return (gate.valid() ? 1.0f : 0.5f) / std::max(1.0f, gate.p_CG.norm()); }

/// A point where no gate is: on something seen, or in the empty space before it.
Eigen::Vector3d gate_free_point(std::span<const float> noisy_m, std::span<const GateLabel> gates, Random* random) {
  const CameraModel& camera = dataset_camera();
  Eigen::Vector3d point_C(0.0, 0.0, 3.0);
  for (int attempt = 0; attempt < 12; ++attempt) {
    const int u = static_cast<int>(random->below(kImageWidth_px));
    const int v = static_cast<int>(random->below(kImageHeight_px));
    const double seen = noisy_m[static_cast<std::size_t>(v) * kImageWidth_px + u];
    double depth = seen > 0.0 ? seen + 0.3 * random->normal() : random->uniform(0.6, 9.0);
    if (random->chance(0.3)) depth = random->uniform(0.6, std::max(0.7, depth));
    point_C = camera.ray_C(u, v) * std::clamp(depth, 0.5, 9.5);
    const bool free = std::none_of(gates.begin(), gates.end(), [&](const GateLabel& gate) {
      return (gate.p_CG.cast<double>() - point_C).norm() < 1.2;
    });
    if (free) break;
  }
  return point_C;
}

void resize(const BatchOptions& options, Batch* batch) {
  const auto images = static_cast<std::size_t>(options.images);
  const auto crops = images * static_cast<std::size_t>(options.design.plain() ? 1 : options.crops_per_image);
  const model::LookShape look = model::look_shape(kImageWidth_px, kImageHeight_px);
  const auto points = static_cast<std::size_t>(options.points);
  batch->images = options.images;
  batch->crops = static_cast<int>(crops);
  batch->points = options.points;
  batch->noisy_m.resize(images * kImageSize_px);
  batch->clean_m.resize(images * kImageSize_px);
  batch->gates.resize(images);
  batch->gate_count.resize(images);
  batch->has_clean.resize(images);
  const auto depth_size = static_cast<std::size_t>(options.design.plain() ? kPlainDepthWidth * kPlainDepthHeight
                                                                          : kDepthTargetSize * kDepthTargetSize);
  if (options.design.plain()) {
    batch->image.resize(images * 2 * kImageSize_px);
  } else {
    batch->look_input.resize(images * look.input_size());
    batch->anchors.resize(images * look.anchor_size());
    batch->frame_mask.resize(images * static_cast<std::size_t>(look.anchor_width() * look.anchor_height()));
    batch->look_target.resize(images * 4);
    batch->crop_predicted.resize(crops);
    batch->crop_input.resize(crops * options.design.crop().input_size());
    batch->crop_context.resize(crops * model::kCropContext);
    batch->crop_center.resize(crops * 3);
  }
  batch->target_center.resize(crops * 3);
  batch->target_normal.resize(crops * 6);
  batch->target_weight.resize(crops);
  batch->validity.resize(crops);
  batch->validity_weight.resize(crops);
  batch->points_C.resize(crops * points * 3);
  batch->sdf_m.resize(crops * points);
  batch->clean_depth.resize(crops * depth_size);
  batch->clean_weight.resize(crops * depth_size);
}

/// With one source nothing is drawn, so that such runs don't depend on there being others.
const Source& pick(std::span<const Source> sources, Random* random) {
  if (sources.size() == 1) return sources.front();
  double sum = 0.0;
  for (const Source& source : sources) sum += source.part;
  double left = random->uniform() * sum;
  for (const Source& source : sources) {
    left -= source.part;
    if (left < 0.0) return source;
  }
  return sources.back();
}

/// Draws image `i` of the batch: which sample, its noise, its mirror image.
void draw_image(std::span<const Source> sources, const BatchOptions& options, int i, Random* random, Batch* batch) {
  const auto at = static_cast<std::size_t>(i);
  // Every pass over the set visits each sample about once: index by a random draw costs nothing that matters and needs
  // no shuffled list that a resumed run would have to rebuild.
  const std::uint64_t wide = (std::uint64_t{random->bits()} << 32) | random->bits();
  const Source& source = pick(sources, random);
  Sample rendered;
  if (source.dataset == nullptr)
    rendered = generate(source.seed, wide, source.round_part, scene::rendered_camera(options.noise, dataset_camera()));
  const SampleView sample =
      source.dataset == nullptr ? rendered.view() : source.dataset->at(wide % source.dataset->size());
  const std::span noisy(batch->noisy_m.data() + at * kImageSize_px, kImageSize_px);
  const std::span clean(batch->clean_m.data() + at * kImageSize_px, kImageSize_px);
  scene::SensorNoise noise = options.noise;
  noise.scale = random->uniform(options.noise_scale_min, options.noise_scale_max);
  draw_noisy(sample, noise, random, noisy);
  draw_clean(sample, clean);
  batch->has_clean[at] = sample.clean_mm.empty() ? 0 : 1;
  const bool mirror = random->chance(0.5);
  if (mirror) {
    mirror_rows(noisy);
    mirror_rows(clean);
  }
  auto& gates = batch->gates[at];
  batch->gate_count[at] = sample.gate_count;
  for (int g = 0; g < sample.gate_count; ++g) {
    const auto k = static_cast<std::size_t>(g);
    gates[k] = mirror ? mirrored(sample.gates[k]) : sample.gates[k];
  }
  if (options.design.plain()) return;

  const model::LookShape look = model::look_shape(kImageWidth_px, kImageHeight_px);
  const auto blocks = static_cast<std::size_t>(look.anchor_width() * look.anchor_height());
  float* mask = batch->frame_mask.data() + at * blocks;
  std::fill(mask, mask + blocks, 0.0f);
  float* target = batch->look_target.data() + 4 * at;
  std::fill(target, target + 4, 0.0f);
  if (sample.target() != nullptr) {
    std::array<std::uint8_t, kImageSize_px> pixels;
    frame_mask(sample, *sample.target(), pixels);
    if (mirror) mirror_rows(std::span<std::uint8_t>(pixels));
    for (int v = 0; v < kImageHeight_px; ++v) {
      for (int u = 0; u < kImageWidth_px; ++u) {
        if (pixels[static_cast<std::size_t>(v) * kImageWidth_px + u] != 0)
          mask[v / 4 * look.anchor_width() + u / 4] = 1.0f;
      }
    }
    for (int axis = 0; axis < 3; ++axis) target[axis] = gates[0].p_CG[axis];
    target[3] = loss_weight(gates[0]);
  }
  model::first_look_input(noisy, dataset_camera(),
                          {batch->look_input.data() + at * look.input_size(), look.input_size()},
                          {batch->anchors.data() + at * look.anchor_size(), look.anchor_size()});
}

void plan_crop(const BatchOptions& options, int index, Batch* batch) {
  const auto image = static_cast<std::size_t>(index / options.crops_per_image);
  Random random(options.seed, kCropStream + batch->step * 4096 + static_cast<std::uint64_t>(index));
  const std::span gates(batch->gates[image].data(), static_cast<std::size_t>(batch->gate_count[image]));
  std::array<const GateLabel*, kMaxGates> seen{};
  std::uint32_t seen_n = 0;
  for (const GateLabel& gate : gates) {
    if (gate.visible_fraction >= kDimVisibleFraction && gate.p_CG.z() > 0.35f) seen[seen_n++] = &gate;
  }
  // What the first look takes for a gate where none is are the hardest negatives: most crops of such images.
  const double predicted_part = seen_n == 0 ? options.predicted_part_empty : options.predicted_part;
  const double kind = random.uniform();
  batch->crop_predicted[static_cast<std::size_t>(index)] = kind < predicted_part ? 1 : 0;
  if (kind < predicted_part) return;

  if (seen_n == 0 || kind < predicted_part + options.free_part) {
    const std::span<const float> noisy(batch->noisy_m.data() + image * kImageSize_px, kImageSize_px);
    cut_crop(options, index, gate_free_point(noisy, gates, &random), batch);
    return;
  }
  const GateLabel& gate = *seen[random.below(seen_n)];
  const double sigma =
      options.prior_sigma_min_m * std::pow(options.prior_sigma_max_m / options.prior_sigma_min_m, random.uniform());
  Eigen::Vector3d center_C = gate.p_CG.cast<double>();
  for (int axis = 0; axis < 3; ++axis) center_C[axis] += sigma * random.normal();
  cut_crop(options, index, center_C, batch);
}

void make_plain(const BatchOptions& options, int i, Random* random, Batch* batch) {
  const auto at = static_cast<std::size_t>(i);
  const std::span<const float> noisy(batch->noisy_m.data() + at * kImageSize_px, kImageSize_px);
  model::plain_input(noisy, {batch->image.data() + at * 2 * kImageSize_px, 2 * kImageSize_px});
  const GateLabel* gate = nullptr;
  bool dim = false;
  for (int g = 0; g < batch->gate_count[at]; ++g) {
    const GateLabel& candidate = batch->gates[at][static_cast<std::size_t>(g)];
    if (candidate.valid() && gate == nullptr) gate = &candidate;
    dim = dim || (!candidate.valid() && candidate.visible_fraction >= kDimVisibleFraction);
  }
  set_target(gate, gate != nullptr ? loss_weight(*gate) : 0.0f, gate != nullptr ? 1.0f : 0.0f,
             gate != nullptr || !dim ? 1.0f : 0.0f, at, batch);
  set_points(options, gate, at, random, batch);
  // Clean inverse depth at the middle of each block.
  const float* clean = batch->clean_m.data() + at * kImageSize_px;
  for (int row = 0; row < kPlainDepthHeight; ++row) {
    for (int column = 0; column < kPlainDepthWidth; ++column) {
      const int v = (2 * row + 1) * kImageHeight_px / (2 * kPlainDepthHeight);
      const int u = (2 * column + 1) * kImageWidth_px / (2 * kPlainDepthWidth);
      const float z = clean[v * kImageWidth_px + u];
      const auto to = (at * kPlainDepthHeight + static_cast<std::size_t>(row)) * kPlainDepthWidth +
                      static_cast<std::size_t>(column);
      batch->clean_depth[to] = z > 0.0f ? 1.0f / z : 0.0f;
      batch->clean_weight[to] = batch->has_clean[at] != 0 ? 1.0f : 0.0f;
    }
  }
}

}  // namespace

void cut_crop(const BatchOptions& options, int index, Eigen::Vector3d center_C, Batch* batch) {
  const auto at = static_cast<std::size_t>(index);
  const auto image = static_cast<std::size_t>(index / options.crops_per_image);
  const CameraModel& camera = dataset_camera();
  const model::CropShape crop = options.design.crop();
  center_C.z() = std::max(center_C.z(), model::kCropMinDepth_m);
  const std::span<const float> noisy(batch->noisy_m.data() + image * kImageSize_px, kImageSize_px);
  const std::span<const float> clean(batch->clean_m.data() + image * kImageSize_px, kImageSize_px);
  model::crop_input(noisy, camera, crop, center_C,
                    {batch->crop_input.data() + at * crop.input_size(), crop.input_size()},
                    {batch->crop_context.data() + at * model::kCropContext, model::kCropContext});
  constexpr std::size_t depth_size = kDepthTargetSize * kDepthTargetSize;
  model::crop_depth(clean, camera, crop, center_C, crop.size / kDepthTargetSize,
                    {batch->clean_depth.data() + at * depth_size, depth_size},
                    {batch->clean_weight.data() + at * depth_size, depth_size});
  for (std::size_t axis = 0; axis < 3; ++axis) {
    batch->crop_center[3 * at + axis] = static_cast<float>(center_C[static_cast<Eigen::Index>(axis)]);
  }

  const GateLabel* nearest = nullptr;
  float nearest_distance = std::numeric_limits<float>::max();
  bool doubtful = false;  // something of a gate is there, but not enough to call it seen or not seen
  for (int g = 0; g < batch->gate_count[image]; ++g) {
    const GateLabel& gate = batch->gates[image][static_cast<std::size_t>(g)];
    const float distance = (gate.p_CG - center_C.cast<float>()).norm();
    if (gate.visible_fraction < kDimVisibleFraction) continue;
    if (distance < nearest_distance) {
      nearest = &gate;
      nearest_distance = distance;
    }
    if (distance < kCropCaptureRadius_m + 0.1f) doubtful = true;
  }
  Random random(options.seed, kCropStream + (batch->step * 4096 + 2048 + static_cast<std::uint64_t>(index)));
  if (nearest != nullptr && nearest_distance > kCropCaptureRadius_m) nearest = nullptr;
  const bool valid = nearest != nullptr && nearest->valid();
  set_target(nearest, nearest != nullptr ? loss_weight(*nearest) : 0.0f, valid ? 1.0f : 0.0f,
             valid || !doubtful ? 1.0f : 0.0f, at, batch);
  set_points(options, nearest, at, &random, batch);
}

void cut_predicted_crops(const BatchOptions& options, int image, const Eigen::Vector3d& center_C, Batch* batch) {
  bool first = true;
  for (int k = 0; k < options.crops_per_image; ++k) {
    const int crop = image * options.crops_per_image + k;
    if (batch->crop_predicted[static_cast<std::size_t>(crop)] == 0) continue;
    Eigen::Vector3d at_C = center_C;
    if (!first) {
      Random random(options.seed, kCropStream + (batch->step * 4096 + 3072 + static_cast<std::uint64_t>(crop)));
      for (int axis = 0; axis < 3; ++axis) at_C[axis] += options.predicted_jitter_m * random.normal();
    }
    first = false;
    cut_crop(options, crop, at_C, batch);
  }
}

void make_batch(std::span<const Source> sources, const BatchOptions& options, std::uint64_t step, Batch* batch) {
  resize(options, batch);
  batch->step = step;
  for (int i = 0; i < options.images; ++i) {
    Random random(options.seed, kImageStream + step * 4096 + static_cast<std::uint64_t>(i));
    draw_image(sources, options, i, &random, batch);
    if (options.design.plain()) {
      make_plain(options, i, &random, batch);
    } else {
      for (int k = 0; k < options.crops_per_image; ++k) plan_crop(options, i * options.crops_per_image + k, batch);
    }
  }
}

BatchQueue::BatchQueue(std::vector<Source> sources, const BatchOptions& options, std::uint64_t first_step, int threads,
                       int ahead)
    : sources_(std::move(sources)),
      options_(options),
      ahead_(static_cast<std::uint64_t>(ahead)),
      next_to_make_(first_step),
      next_to_give_(first_step) {
  for (int i = 0; i < threads; ++i) threads_.emplace_back([this] { work(); });
}

BatchQueue::~BatchQueue() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  changed_.notify_all();
  for (std::thread& thread : threads_) thread.join();
}

void BatchQueue::work() {
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [this] { return stop_ || next_to_make_ < next_to_give_ + ahead_; });
    if (stop_) return;
    const std::uint64_t step = next_to_make_++;
    std::unique_ptr<Batch> batch;
    if (spare_.empty()) {
      batch = std::make_unique<Batch>();
    } else {
      batch = std::move(spare_.back());
      spare_.pop_back();
    }
    lock.unlock();
    make_batch(sources_, options_, step, batch.get());
    lock.lock();
    ready_[step] = std::move(batch);
    changed_.notify_all();
  }
}

std::unique_ptr<Batch> BatchQueue::next() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return ready_.contains(next_to_give_); });
  auto node = ready_.extract(next_to_give_++);
  changed_.notify_all();
  return std::move(node.mapped());
}

void BatchQueue::recycle(std::unique_ptr<Batch> batch) {
  const std::lock_guard lock(mutex_);
  spare_.push_back(std::move(batch));
}

}  // namespace gatefield::training
