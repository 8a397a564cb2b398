#include <cassert>
#include <cstddef>

#include "server/kernels/decoder/decoder.h"

namespace gatefield::kernels {
namespace {

std::size_t at(int row, int columns, int column) noexcept {
  return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) + static_cast<std::size_t>(column);
}

model::Dense columns_from(const model::Dense& full, int first) {
  model::Dense out;
  out.inputs = full.inputs - first;
  out.outputs = full.outputs;
  for (int i = 0; i < full.outputs; ++i) {
    const auto row = full.weight.begin() + static_cast<std::ptrdiff_t>(at(i, full.inputs, 0));
    out.weight.insert(out.weight.end(), row + first, row + full.inputs);
  }
  return out;
}

/// Concatenated: the columns of z go into the bias, those of the encoded point stay the model's.
void fold_columns(const model::Dense& full, std::span<const float> z, model::Dense* out) {
  out->inputs = full.inputs - static_cast<int>(z.size());
  out->outputs = full.outputs;
  out->weight.clear();
  out->bias.resize(static_cast<std::size_t>(full.outputs));
  for (int i = 0; i < full.outputs; ++i) {
    double bias = full.bias[static_cast<std::size_t>(i)];
    for (int j = 0; j < static_cast<int>(z.size()); ++j)
      bias += double{full.weight[at(i, full.inputs, j)]} * z[static_cast<std::size_t>(j)];
    out->bias[static_cast<std::size_t>(i)] = static_cast<float>(bias);
  }
}

/// Hyper: z generates the first layer, W1 [h][3] (which takes 1 / S in) and then b1 [h].
void generate(const model::Dense& generator, std::span<const float> z, double scale_m, model::Dense* out) {
  const int hidden = generator.outputs / 4;
  out->inputs = 3;
  out->outputs = hidden;
  out->weight.resize(at(hidden, 3, 0));
  out->bias.resize(static_cast<std::size_t>(hidden));
  for (int i = 0; i < generator.outputs; ++i) {
    double value = generator.bias[static_cast<std::size_t>(i)];
    for (int j = 0; j < generator.inputs; ++j) {
      value += double{generator.weight[at(i, generator.inputs, j)]} * z[static_cast<std::size_t>(j)];
    }
    if (i < 3 * hidden) {
      out->weight[static_cast<std::size_t>(i)] = static_cast<float>(value / scale_m);
    } else {
      out->bias[static_cast<std::size_t>(i - 3 * hidden)] = static_cast<float>(value);
    }
  }
}

}  // namespace

PreparedDecoder::PreparedDecoder(const model::DecoderWeights& weights) : weights_(weights) {
  if (!hyper()) point_columns_ = columns_from(weights_.layers[0], weights_.latent_size);
}

void PreparedDecoder::fold(std::span<const float> latent, FoldedDecoder* out) const {
  assert(static_cast<int>(latent.size()) == weights_.latent_size);
  if (hyper()) {
    out->origin_C = {latent[0], latent[1], latent[2]};
    generate(weights_.generator, latent.subspan(3), weights_.position_scale_m, &out->first);
  } else {
    out->origin_C.setZero();
    fold_columns(weights_.layers[0], latent, &out->first);
  }
  lay_out(out);
}

void FoldedDecoder::place(const Eigen::Isometry3d& X_WC) noexcept {
  const Eigen::Isometry3d X_CW = X_WC.inverse();
  R_CW = (X_CW.linear() / unit_m).cast<float>();
  t_CW = (X_CW.translation() / unit_m - origin_C).cast<float>();
}

void fold(const std::shared_ptr<const PreparedDecoder>& prepared, std::span<const float> latent,
          const Eigen::Isometry3d& X_WC, FoldedDecoder* out, double unit_m) {
  prepared->fold(latent, out);
  out->prepared = prepared;
  out->unit_m = unit_m;
  out->place(X_WC);
}

void adopt(const std::shared_ptr<const PreparedDecoder>& prepared, FoldedDecoder* folded) {
  prepared->lay_out(folded);
  folded->prepared = prepared;
}

}  // namespace gatefield::kernels
