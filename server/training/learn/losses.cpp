#include "server/training/learn/losses.h"

#include <cmath>
#include <span>
#include <vector>

#include "common/base/statistics.h"
#include "server/training/learn/tensors.h"

namespace gatefield::training {
namespace {

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
  const float median = quantile_in_place(std::span(values), 0.5);
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

/// The losses of what was seen of a gate. @param code  the encoder's output, @param from  [C, 3] what its centre is
/// told relative to
torch::Tensor losses_on_gate(Model& model, const Design& design, bool bf16, Batch* batch, const torch::Tensor& code,
                             const torch::Tensor& from, StepLosses* out) {
  const std::int64_t crops = batch->crops;
  const std::int64_t points = batch->points;
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
    field_m = model->hyper(z, points_C - center.unsqueeze(1));
    center_error = weighted_mean((center - wrap(batch->target_center, {crops, 3})).abs().mean(1), weight);
    out->center_m = center_error.item<double>();
  } else {
    field_m = model->concatenated(z, points_C);
  }
  const auto difference = (field_m - wrap(batch->sdf_m, {crops, points})).abs();
  const auto field = weighted_mean(difference.mean(1), weight);

  const auto close =
      ((points_C - wrap(batch->target_center, {crops, 3}).unsqueeze(1)).norm(2, 2) < 1.2).to(torch::kFloat);
  const auto box = ((difference.detach() * close).sum(1) / close.sum(1).clamp_min(1.0)).detach();
  const auto predicted_error = weighted_mean((log_error - torch::log(box + 0.005)).abs(), weight);

  const auto normal = weighted_mean((model->normal(z) - wrap(batch->target_normal, {crops, 6})).abs().mean(1), weight);
  const auto asked = wrap(batch->validity_weight, {crops});
  const auto validity = weighted_mean(torch::binary_cross_entropy_with_logits(
                                          validity_logit, wrap(batch->validity, {crops}), {}, {}, at::Reduction::None),
                                      asked);
  const auto rebuilt = model->depth(z, bf16).flatten(1);
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

torch::Tensor losses_two_look(Model& model, const Design& design, bool bf16, const BatchOptions& batch_options,
                              Batch* batch, StepLosses* out) {
  const std::int64_t images = batch->images;
  const std::int64_t crops = batch->crops;
  const auto shape = model::look_shape(kImageWidth_px, kImageHeight_px);
  const std::int64_t rows = shape.anchor_height();
  const std::int64_t columns = shape.anchor_width();
  const auto look =
      model->first(wrap_image(batch->look_input, {images, model::kLookChannels, shape.height, shape.width}),
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
  const std::int64_t size = design.crop_size;
  const auto code = model->second(wrap_image(batch->crop_input, {crops, model::kCropChannels, size, size}),
                                  wrap(batch->crop_context, {crops, model::kCropContext}), bf16);
  const auto on_gate = losses_on_gate(model, design, bf16, batch, code, wrap(batch->crop_center, {crops, 3}), out);

  out->first_center_m = first_center.item<double>();
  out->segmentation = segmentation.item<double>();
  return on_gate + 0.5 * first_center + 0.3 * votes + 0.3 * segmentation;
}

torch::Tensor losses_plain(Model& model, const Design& design, bool bf16, Batch* batch, StepLosses* out) {
  const std::int64_t images = batch->images;
  const auto code = model->encoder(wrap_image(batch->image, {images, 2, kImageHeight_px, kImageWidth_px}), bf16);
  return losses_on_gate(model, design, bf16, batch, code, torch::zeros({images, 3}), out);
}

}  // namespace

torch::Tensor losses(Model& model, const Design& design, bool bf16, const BatchOptions& batch_options, Batch* batch,
                     StepLosses* out) {
  return design.plain() ? losses_plain(model, design, bf16, batch, out)
                        : losses_two_look(model, design, bf16, batch_options, batch, out);
}

}  // namespace gatefield::training
