#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "server/kernels/decoder/decoder.h"
#include "server/kernels/decoder/view.h"

namespace gatefield::kernels {

void decode_reference(const FoldedDecoder& folded, std::span<const float> x_W, std::span<const float> y_W,
                      std::span<const float> z_W, std::span<float> sdf_m) noexcept {
  const PreparedDecoder& prepared = *folded.prepared;
  const std::span<const model::Dense> inner = prepared.inner();
  const std::vector<float>& first_weight = prepared.hyper() ? folded.first.weight : prepared.point_columns().weight;
  const int octaves = prepared.hyper() ? 0 : prepared.weights().encoding_octaves;
  const double inverse_scale = static_cast<float>(1.0 / prepared.weights().position_scale_m);
  std::array<double, kMaxWidth> in{}, out{};
  for (std::size_t n = 0; n < sdf_m.size(); ++n) {
    const Eigen::Vector3d p_W(x_W[n], y_W[n], z_W[n]);
    if (!p_W.allFinite()) {
      sdf_m[n] = std::numeric_limits<float>::quiet_NaN();
      continue;
    }
    Eigen::Vector3d p_C = folded.R_CW.cast<double>() * p_W + folded.t_CW.cast<double>();
    p_C = p_C.cwiseMax(-kMaxCoordinate_m).cwiseMin(kMaxCoordinate_m);
    std::size_t width = 0;
    for (int axis = 0; axis < 3; ++axis) in[width++] = p_C[axis];
    for (int octave = 0; octave < octaves; ++octave) {
      const double factor = std::numbers::pi * std::exp2(octave) * inverse_scale;
      for (int axis = 0; axis < 3; ++axis) in[width++] = std::sin(factor * p_C[axis]);
      for (int axis = 0; axis < 3; ++axis) in[width++] = std::cos(factor * p_C[axis]);
    }
    for (std::size_t l = 0; l <= inner.size(); ++l) {
      const model::Dense& layer = l == 0 ? folded.first : inner[l - 1];
      const std::vector<float>& weight = l == 0 ? first_weight : layer.weight;
      const auto inputs = static_cast<std::size_t>(layer.inputs);
      for (std::size_t i = 0; i < static_cast<std::size_t>(layer.outputs); ++i) {
        double value = layer.bias[i];
        for (std::size_t j = 0; j < inputs; ++j) value += double{weight[i * inputs + j]} * in[j];
        out[i] = l == inner.size() ? value : std::max(value, 0.0);
      }
      in = out;
    }
    sdf_m[n] = static_cast<float>(folded.unit_m * in[0]);
  }
}

}  // namespace gatefield::kernels
