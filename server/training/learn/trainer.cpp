#include "server/training/learn/trainer.h"

#include <ATen/Parallel.h>
#include <dlfcn.h>
#include <torch/nn.h>
#include <torch/optim/adamw.h>
#include <torch/utils.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "server/training/learn/checkpoint.h"
#include "server/training/learn/losses.h"
#include "server/training/learn/model.h"
#include "server/training/learn/tensors.h"

namespace gatefield::training {
namespace {

/// Debian's libtorch multiplies through OpenBLAS, whose own pool spins between its short jobs and starves the data
/// thread.
void set_blas_threads(int threads) {
  using Setter = void (*)(int);
  if (auto* set = reinterpret_cast<Setter>(dlsym(RTLD_DEFAULT, "openblas_set_num_threads")); set != nullptr)
    set(threads);
}

}  // namespace

struct Trainer::State {
  explicit State(const TrainerOptions& chosen)
      : options(chosen), bf16(chosen.allow_bf16 && cpu_has_bf16()), live(chosen.design), averaged(chosen.design) {
    lay_out(live.get());
    torch::NoGradGuard guard;
    const auto from = live->named_parameters();
    for (auto& item : averaged->named_parameters()) item.value().copy_(from[item.key()]);
    averaged->eval();
    std::vector<torch::Tensor> learning;
    for (auto& item : live->named_parameters()) {
      const bool decodes = item.key().rfind("decoder.", 0) == 0 || item.key().rfind("depth.", 0) == 0 ||
                           item.key().rfind("normal.", 0) == 0;
      if (options.freeze_decoders && decodes) {
        item.value().requires_grad_(false);
      } else {
        learning.push_back(item.value());
      }
    }
    optimizer = std::make_unique<torch::optim::AdamW>(
        std::move(learning), torch::optim::AdamWOptions(options.learning_rate).weight_decay(options.weight_decay));
  }

  double learning_rate() const {
    const auto at = static_cast<double>(step);
    const auto warmup = static_cast<double>(options.warmup_steps);
    if (at < warmup) return options.learning_rate * (at + 1.0) / warmup;
    const double part = std::min(1.0, (at - warmup) / std::max(1.0, static_cast<double>(options.total_steps) - warmup));
    return options.learning_rate * 0.5 * (1.0 + std::cos(std::numbers::pi * part));
  }

  CheckpointParts parts() { return {live, averaged, *optimizer}; }

  TrainerOptions options;
  bool bf16;
  Model live;
  Model averaged;
  std::unique_ptr<torch::optim::AdamW> optimizer;
  std::uint64_t step = 0;
};

Result<std::unique_ptr<Trainer>> Trainer::create(const TrainerOptions& options) {
  try {
    at::set_num_threads(std::max(1, options.threads));
    set_blas_threads(std::max(1, options.threads));
    torch::manual_seed(options.seed);
    return std::unique_ptr<Trainer>(new Trainer(std::make_unique<State>(options)));
  } catch (const std::exception& error) {
    return Error{"libtorch could not set up the networks: " + first_line(error)};
  }
}

Trainer::Trainer(std::unique_ptr<State> state) : state_(std::move(state)) {}
Trainer::~Trainer() = default;

std::uint64_t Trainer::steps() const noexcept { return state_->step; }
bool Trainer::bf16() const noexcept { return state_->bf16; }
const Design& Trainer::design() const noexcept { return state_->options.design; }

Result<StepLosses> Trainer::step(const BatchOptions& batch_options, Batch* batch) {
  try {
    StepLosses parts;
    const double rate = state_->learning_rate();
    for (auto& group : state_->optimizer->param_groups())
      static_cast<torch::optim::AdamWOptions&>(group.options()).lr(rate);
    state_->optimizer->zero_grad();
    const auto total = losses(state_->live, design(), state_->bf16, batch_options, batch, &parts);
    parts.total = total.item<double>();
    if (!std::isfinite(parts.total)) {
      return Error{"the loss of step " + std::to_string(state_->step) +
                   " is not finite; continue from the last checkpoint with a lower --rate"};
    }
    total.backward();
    torch::nn::utils::clip_grad_norm_(state_->live->parameters(), 2.0);
    state_->optimizer->step();
    ++state_->step;

    torch::NoGradGuard guard;
    // A short memory at first, so that the average doesn't carry the initial weights along.
    const double keep = std::min(state_->options.average_decay,
                                 static_cast<double>(state_->step) / (static_cast<double>(state_->step) + 10.0));
    const auto from = state_->live->parameters();
    const auto to = state_->averaged->parameters();
    for (std::size_t i = 0; i < from.size(); ++i) to[i].lerp_(from[i], 1.0 - keep);
    return parts;
  } catch (const std::exception& error) {
    return Error{"libtorch stopped in step " + std::to_string(state_->step) + ": " + first_line(error)};
  }
}

Status Trainer::save(const std::filesystem::path& file) const {
  return save_checkpoint(file, design(), state_->step, state_->parts());
}

Status Trainer::load(const std::filesystem::path& file) {
  const auto step = load_checkpoint(file, design(), state_->parts());
  if (!step) return step.failure();
  state_->step = *step;
  return {};
}

Result<Design> Trainer::design_of(const std::filesystem::path& file) { return checkpoint_design(file); }

Result<std::vector<std::string>> Trainer::start_from(const std::filesystem::path& file) {
  const auto design = design_of(file);
  if (!design) return design.failure();
  const auto other = averaged_in(file, *design);
  if (!other) return other.failure();
  try {
    torch::NoGradGuard guard;
    const auto from = (*other)->named_parameters();
    const auto to_averaged = state_->averaged->named_parameters();
    std::vector<std::string> left;
    for (auto& item : state_->live->named_parameters()) {
      const auto* source = from.find(item.key());
      if (source == nullptr || source->sizes() != item.value().sizes()) {
        left.push_back(item.key());
        continue;
      }
      item.value().copy_(*source);
      to_averaged[item.key()].copy_(*source);
    }
    return left;
  } catch (const std::exception& error) {
    return Error{"checkpoint " + file.string() + " can't be taken over: " + first_line(error)};
  }
}

Weights Trainer::weights() const { return weights_in(*state_->averaged); }

Result<Weights> Trainer::weights_of(const std::filesystem::path& file) {
  const auto design = design_of(file);
  if (!design) return design.failure();
  const auto model = averaged_in(file, *design);
  if (!model) return model.failure();
  return weights_in(**model);
}

std::array<float, 3> Trainer::first_look(std::span<const float> input, std::span<const float> anchors) const {
  torch::NoGradGuard guard;
  const auto shape = model::look_shape(kImageWidth_px, kImageHeight_px);
  const auto center =
      unwrap(state_->averaged
                 ->first(wrap(input, {1, model::kLookChannels, shape.height, shape.width}),
                         wrap(anchors, {1, model::kAnchorChannels, shape.anchor_height(), shape.anchor_width()}), false)
                 .center);
  return {center[0], center[1], center[2]};
}

std::vector<float> Trainer::second_look(std::span<const float> crop, std::span<const float> context) const {
  torch::NoGradGuard guard;
  const std::int64_t size = state_->options.design.crop_size;
  return unwrap(state_->averaged->second(wrap(crop, {1, model::kCropChannels, size, size}),
                                         wrap(context, {1, model::kCropContext}), false));
}

std::vector<float> Trainer::plain(std::span<const float> image) const {
  torch::NoGradGuard guard;
  return unwrap(state_->averaged->encoder(wrap(image, {1, 2, kImageHeight_px, kImageWidth_px}), false));
}

std::vector<float> Trainer::decode(std::span<const float> latent, std::span<const float> points_C) const {
  torch::NoGradGuard guard;
  const auto points = wrap(points_C, {1, static_cast<std::int64_t>(points_C.size() / 3), 3});
  const std::int64_t z_n = state_->options.design.latent_z;
  if (!state_->options.design.has_center())
    return unwrap(state_->averaged->concatenated(wrap(latent, {1, z_n}), points));
  return unwrap(state_->averaged->hyper(wrap(latent.subspan(3), {1, z_n}), points - wrap(latent.first(3), {1, 1, 3})));
}

}  // namespace gatefield::training
