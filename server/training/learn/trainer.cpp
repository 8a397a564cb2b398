#include "server/training/learn/trainer.h"

#include <ATen/Parallel.h>
#include <dlfcn.h>
#include <torch/nn.h>
#include <torch/optim/adamw.h>
#include <torch/serialize.h>
#include <torch/utils.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "server/training/learn/networks.h"

namespace gatefield::training {
namespace {

/// Everything that is trained, as one module, so that one name space serves optimiser, checkpoint and export.
struct ModelImpl : torch::nn::Module {
  explicit ModelImpl(const Design& design) {
    const int z = design.latent_z;
    if (design.plain()) {
      encoder = register_module("encoder", PlainEncoder(design, kImageWidth_px, kImageHeight_px));
      depth = register_module("depth", DepthDecoder(z, kPlainDepthHeight, kPlainDepthWidth));
    } else {
      first = register_module("first", FirstLook());
      second = register_module("second", SecondLook(design));
      depth = register_module("depth", DepthDecoder(z, kDepthTargetSize, kDepthTargetSize));
    }
    if (design.decoder == model::DecoderKind::kHyper) {
      hyper = register_module("decoder", HyperDecoder(z, kHyperScale_m));
    } else {
      concatenated = register_module("decoder", ConcatenatedDecoder(z, kPlainOctaves, kPlainScale_m));
    }
    normal = register_module("normal", torch::nn::Linear(z, 6));
  }

  FirstLook first{nullptr};
  SecondLook second{nullptr};
  HyperDecoder hyper{nullptr};
  PlainEncoder encoder{nullptr};
  ConcatenatedDecoder concatenated{nullptr};
  DepthDecoder depth{nullptr};
  torch::nn::Linear normal{nullptr};
};
TORCH_MODULE(Model);

torch::Tensor wrap(std::vector<float>& values, at::IntArrayRef shape) {
  return torch::from_blob(values.data(), shape, torch::kFloat);
}

/// Convolutions run a good deal faster on the channels-last layout.
torch::Tensor wrap_image(std::vector<float>& values, at::IntArrayRef shape) {
  return wrap(values, shape).contiguous(at::MemoryFormat::ChannelsLast);
}

void lay_out(torch::nn::Module* module) {
  torch::NoGradGuard guard;
  for (auto& parameter : module->parameters()) {
    if (parameter.dim() == 4) parameter.set_data(parameter.contiguous(at::MemoryFormat::ChannelsLast));
  }
}

torch::Tensor wrap(std::span<const float> values, at::IntArrayRef shape) {
  return torch::from_blob(const_cast<float*>(values.data()), shape, torch::kFloat);
}

std::vector<float> unwrap(const torch::Tensor& tensor) {
  const auto flat = tensor.detach().to(torch::kFloat).contiguous().view(-1);
  return {flat.data_ptr<float>(), flat.data_ptr<float>() + flat.numel()};
}

/// sum(values * weights) / sum(weights), zero (with a gradient path) when nothing has weight.
torch::Tensor weighted_mean(const torch::Tensor& values, const torch::Tensor& weights) {
  return (values * weights).sum() / weights.sum().clamp_min(1e-3);
}

/// L1 of the best constant: what a network that ignores its input reaches.
double constant_level(const Batch& batch) {
  std::vector<float> values;
  const auto points = static_cast<std::size_t>(batch.points);
  for (std::size_t crop = 0; crop < static_cast<std::size_t>(batch.crops); ++crop) {
    if (batch.target_weight[crop] == 0.0f) continue;
    values.insert(values.end(), batch.sdf_m.begin() + static_cast<std::ptrdiff_t>(crop * points),
                  batch.sdf_m.begin() + static_cast<std::ptrdiff_t>((crop + 1) * points));
  }
  if (values.empty()) return 0.0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  const float median = *middle;
  double sum = 0.0;
  double weight = 0.0;
  for (std::size_t crop = 0; crop < static_cast<std::size_t>(batch.crops); ++crop) {
    const double w = batch.target_weight[crop];
    if (w == 0.0) continue;
    for (std::size_t i = 0; i < points; ++i) sum += w * std::abs(batch.sdf_m[crop * points + i] - median);
    weight += w * static_cast<double>(points);
  }
  return sum / weight;
}

/// Debian's libtorch multiplies through OpenBLAS, whose own pool spins between its short jobs and starves the data
/// thread.
void set_blas_threads(int threads) {
  using Setter = void (*)(int);
  if (auto* set = reinterpret_cast<Setter>(dlsym(RTLD_DEFAULT, "openblas_set_num_threads")); set != nullptr)
    set(threads);
}

std::string first_line(const std::exception& error) {
  const std::string text = error.what();
  return text.substr(0, text.find('\n'));
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

  torch::Tensor losses_two_look(const BatchOptions& batch_options, Batch* batch, StepLosses* out);
  torch::Tensor losses_plain(Batch* batch, StepLosses* out);
  /// @param code  the encoder's output, @param from  [C, 3] what its centre is told relative to
  torch::Tensor losses_on_gate(Batch* batch, const torch::Tensor& code, const torch::Tensor& from, StepLosses* out);

  TrainerOptions options;
  bool bf16;
  Model live;
  Model averaged;
  std::unique_ptr<torch::optim::AdamW> optimizer;
  std::uint64_t step = 0;
};

torch::Tensor Trainer::State::losses_on_gate(Batch* batch, const torch::Tensor& code, const torch::Tensor& from,
                                             StepLosses* out) {
  const std::int64_t crops = batch->crops;
  const std::int64_t points = batch->points;
  const Design& design = options.design;
  const std::int64_t z_at = design.has_center() ? 3 : 0;
  const auto z = code.narrow(1, z_at, design.latent_z);
  const auto validity_logit = code.select(1, z_at + design.latent_z);
  const auto log_error = code.select(1, z_at + design.latent_z + 1);
  const auto weight = wrap(batch->target_weight, {crops});
  const auto points_C = wrap(batch->points_C, {crops, points, 3});
  torch::Tensor field_m;
  torch::Tensor center_error;
  if (design.has_center()) {
    const auto center = from + code.narrow(1, 0, 3);
    field_m = live->hyper(z, points_C - center.unsqueeze(1));
    center_error = weighted_mean((center - wrap(batch->target_center, {crops, 3})).abs().mean(1), weight);
    out->center_m = center_error.item<double>();
  } else {
    field_m = live->concatenated(z, points_C);
  }
  const auto difference = (field_m - wrap(batch->sdf_m, {crops, points})).abs();
  const auto field = weighted_mean(difference.mean(1), weight);

  const auto close =
      ((points_C - wrap(batch->target_center, {crops, 3}).unsqueeze(1)).norm(2, 2) < 1.2).to(torch::kFloat);
  const auto box = ((difference.detach() * close).sum(1) / close.sum(1).clamp_min(1.0)).detach();
  const auto predicted_error = weighted_mean((log_error - torch::log(box + 0.005)).abs(), weight);

  const auto normal = weighted_mean((live->normal(z) - wrap(batch->target_normal, {crops, 6})).abs().mean(1), weight);
  const auto asked = wrap(batch->validity_weight, {crops});
  const auto validity = weighted_mean(torch::binary_cross_entropy_with_logits(
                                          validity_logit, wrap(batch->validity, {crops}), {}, {}, at::Reduction::None),
                                      asked);
  const auto rebuilt = live->depth(z, bf16).flatten(1);
  const auto shown = wrap(batch->clean_weight, {crops, rebuilt.size(1)});
  const auto depth = weighted_mean((rebuilt - wrap(batch->clean_depth, {crops, rebuilt.size(1)})).abs(), shown);

  out->field_m = field.item<double>();
  out->box_m = weighted_mean(box, weight).item<double>();
  out->predicted_error = predicted_error.item<double>();
  out->normal = normal.item<double>();
  out->validity = validity.item<double>();
  out->depth = depth.item<double>();
  out->constant_m = constant_level(*batch);
  const auto total = field + 0.5 * normal + design.validity_weight() * validity + 0.2 * depth + 0.05 * predicted_error;
  return design.has_center() ? total + 2.0 * center_error : total;
}

torch::Tensor Trainer::State::losses_two_look(const BatchOptions& batch_options, Batch* batch, StepLosses* out) {
  const std::int64_t images = batch->images;
  const std::int64_t crops = batch->crops;
  const auto shape = model::look_shape(kImageWidth_px, kImageHeight_px);
  const std::int64_t rows = shape.anchor_height();
  const std::int64_t columns = shape.anchor_width();
  const auto look =
      live->first(wrap_image(batch->look_input, {images, model::kLookChannels, shape.height, shape.width}),
                  wrap(batch->anchors, {images, model::kAnchorChannels, rows, columns}), bf16);

  const auto frame = wrap(batch->frame_mask, {images, rows, columns});
  const auto target = wrap(batch->look_target, {images, 4});
  const auto weight = target.select(1, 3);
  const auto center = target.narrow(1, 0, 3);
  const auto segmentation =
      torch::binary_cross_entropy_with_logits(look.segmentation, frame, {}, torch::full({1}, 4.0f));
  const auto on_frame = frame.flatten(1);
  const auto vote_error = (look.votes - center.unsqueeze(2)).abs().mean(1);
  const auto votes = weighted_mean((vote_error * on_frame).sum(1) / on_frame.sum(1).clamp_min(1.0), weight);
  const auto first_center = weighted_mean((look.center - center).abs().mean(1), weight);

  // No gradient goes through the cropping.
  const auto seen = unwrap(look.center);
  for (int image = 0; image < batch->images; ++image) {
    const auto at = static_cast<std::size_t>(3 * image);
    cut_predicted_crops(batch_options, image, Eigen::Vector3d(seen[at], seen[at + 1], seen[at + 2]), batch);
  }
  const std::int64_t size = options.design.crop_size;
  const auto code = live->second(wrap_image(batch->crop_input, {crops, model::kCropChannels, size, size}),
                                 wrap(batch->crop_context, {crops, model::kCropContext}), bf16);
  const auto on_gate = losses_on_gate(batch, code, wrap(batch->crop_center, {crops, 3}), out);

  out->first_center_m = first_center.item<double>();
  out->segmentation = segmentation.item<double>();
  return on_gate + 0.5 * first_center + 0.3 * votes + 0.3 * segmentation;
}

torch::Tensor Trainer::State::losses_plain(Batch* batch, StepLosses* out) {
  const std::int64_t images = batch->images;
  const auto code = live->encoder(wrap_image(batch->image, {images, 2, kImageHeight_px, kImageWidth_px}), bf16);
  return losses_on_gate(batch, code, torch::zeros({images, 3}), out);
}

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
    StepLosses losses;
    const double rate = state_->learning_rate();
    for (auto& group : state_->optimizer->param_groups())
      static_cast<torch::optim::AdamWOptions&>(group.options()).lr(rate);
    state_->optimizer->zero_grad();
    const auto total = state_->options.design.plain() ? state_->losses_plain(batch, &losses)
                                                      : state_->losses_two_look(batch_options, batch, &losses);
    losses.total = total.item<double>();
    if (!std::isfinite(losses.total)) {
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
    return losses;
  } catch (const std::exception& error) {
    return Error{"libtorch stopped in step " + std::to_string(state_->step) + ": " + first_line(error)};
  }
}

Status Trainer::save(const std::filesystem::path& file) const {
  const std::filesystem::path part = file.string() + ".part";
  try {
    torch::serialize::OutputArchive archive;
    torch::serialize::OutputArchive live;
    torch::serialize::OutputArchive averaged;
    torch::serialize::OutputArchive optimizer;
    state_->live->save(live);
    state_->averaged->save(averaged);
    state_->optimizer->save(optimizer);
    archive.write("live", live);
    archive.write("averaged", averaged);
    archive.write("optimizer", optimizer);
    archive.write("step", torch::tensor(static_cast<std::int64_t>(state_->step)));
    archive.write("design", c10::IValue(std::string(state_->options.design.name)));
    archive.save_to(part.string());
    std::filesystem::rename(part, file);
    return {};
  } catch (const std::exception& error) {
    return Error{"checkpoint " + file.string() + " could not be written: " + first_line(error)};
  }
}

Result<Design> Trainer::design_of(const std::filesystem::path& file) {
  if (!std::filesystem::exists(file)) return Error{"checkpoint " + file.string() + " does not exist"};
  try {
    torch::serialize::InputArchive archive;
    archive.load_from(file.string());
    c10::IValue name;
    archive.read("design", name);
    auto design = find_design(name.toStringRef());
    if (!design) return Error{"checkpoint " + file.string() + ": " + design.error()};
    return design;
  } catch (const std::exception& error) {
    return Error{"checkpoint " + file.string() + " can't be read: " + first_line(error)};
  }
}

Status Trainer::load(const std::filesystem::path& file) {
  const auto design = design_of(file);
  if (!design) return Error{design.error()};
  if (design->name != state_->options.design.name) {
    return Error{"checkpoint " + file.string() + " belongs to the design '" + std::string(design->name) +
                 "', expected '" + std::string(state_->options.design.name) + "'"};
  }
  try {
    torch::serialize::InputArchive archive;
    archive.load_from(file.string());
    torch::Tensor number;
    torch::serialize::InputArchive live;
    torch::serialize::InputArchive averaged;
    torch::serialize::InputArchive optimizer;
    archive.read("live", live);
    archive.read("averaged", averaged);
    archive.read("optimizer", optimizer);
    state_->live->load(live);
    state_->averaged->load(averaged);
    state_->optimizer->load(optimizer);
    lay_out(state_->live.get());
    archive.read("step", number);
    state_->step = static_cast<std::uint64_t>(number.item<std::int64_t>());
    return {};
  } catch (const std::exception& error) {
    return Error{"checkpoint " + file.string() + " can't be read: " + first_line(error)};
  }
}

namespace {

Weights weights_in(const torch::nn::Module& model) {
  Weights out;
  for (const auto& item : model.named_parameters()) {
    NamedTensor tensor;
    tensor.shape.assign(item.value().sizes().begin(), item.value().sizes().end());
    tensor.values = unwrap(item.value());
    out.emplace(item.key(), std::move(tensor));
  }
  return out;
}

/// The averaged networks of a checkpoint. libtorch's exceptions pass through.
Model averaged_in(const std::filesystem::path& file, const Design& design) {
  torch::serialize::InputArchive archive;
  archive.load_from(file.string());
  torch::serialize::InputArchive averaged;
  archive.read("averaged", averaged);
  Model model(design);
  model->load(averaged);
  return model;
}

}  // namespace

Result<std::vector<std::string>> Trainer::start_from(const std::filesystem::path& file) {
  const auto design = design_of(file);
  if (!design) return Error{design.error()};
  try {
    const Model other = averaged_in(file, *design);
    torch::NoGradGuard guard;
    const auto from = other->named_parameters();
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
    return Error{"checkpoint " + file.string() + " can't be read: " + first_line(error)};
  }
}

Weights Trainer::weights() const { return weights_in(*state_->averaged); }

Result<Weights> Trainer::weights_of(const std::filesystem::path& file) {
  const auto design = design_of(file);
  if (!design) return Error{design.error()};
  try {
    return weights_in(*averaged_in(file, *design));
  } catch (const std::exception& error) {
    return Error{"checkpoint " + file.string() + " can't be read: " + first_line(error)};
  }
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
