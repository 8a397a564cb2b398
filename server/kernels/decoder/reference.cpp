#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "server/kernels/decoder/decoder.h"
#include "server/kernels/isa.h"

namespace gatefield::kernels {

double decode_tolerance_m() noexcept {
  return decoder_arithmetic() == Arithmetic::kInt16 ? 0.004 : decoder_arithmetic() == Arithmetic::kTiles ? 1e-3 : 1e-4;
}

void decode_reference(const FoldedDecoder& decoder, std::span<const float> x_W, std::span<const float> y_W,
                      std::span<const float> z_W, std::span<float> sdf_m) noexcept {
  std::array<double, kMaxWidth> in{}, out{};
  for (std::size_t n = 0; n < sdf_m.size(); ++n) {
    const Eigen::Vector3d p_W(x_W[n], y_W[n], z_W[n]);
    if (!p_W.allFinite()) {
      sdf_m[n] = std::numeric_limits<float>::quiet_NaN();
      continue;
    }
    Eigen::Vector3d p_C = decoder.R_CW.cast<double>() * p_W + decoder.t_CW.cast<double>();
    p_C = p_C.cwiseMax(-kMaxCoordinate_m).cwiseMin(kMaxCoordinate_m);
    std::size_t width = 0;
    for (int axis = 0; axis < 3; ++axis) in[width++] = p_C[axis];
    for (int octave = 0; octave < decoder.encoding_octaves; ++octave) {
      const double factor = std::numbers::pi * std::exp2(octave) * decoder.inverse_scale;
      for (int axis = 0; axis < 3; ++axis) in[width++] = std::sin(factor * p_C[axis]);
      for (int axis = 0; axis < 3; ++axis) in[width++] = std::cos(factor * p_C[axis]);
    }
    for (std::size_t l = 0; l < decoder.layers.size(); ++l) {
      const model::Dense& layer = decoder.layers[l];
      const bool last = l + 1 == decoder.layers.size();
      const auto inputs = static_cast<std::size_t>(layer.inputs);
      for (std::size_t i = 0; i < static_cast<std::size_t>(layer.outputs); ++i) {
        double value = layer.bias[i];
        for (std::size_t j = 0; j < inputs; ++j) value += double{layer.weight[i * inputs + j]} * in[j];
        out[i] = last ? value : std::max(value, 0.0);
      }
      in = out;
    }
    sdf_m[n] = static_cast<float>(in[0]);
  }
}

}  // namespace gatefield::kernels
