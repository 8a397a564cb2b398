#pragma once

#include "server/gates/field.h"
#include "server/kernels/decoder/decoder.h"

namespace gatefield::perception {

/// The learned field in the world frame: a decoder with its latent and capture pose folded in.
class DecodedField : public gates::Field {
 public:
  kernels::FoldedDecoder decoder;
  void evaluate(std::span<const float> x_W, std::span<const float> y_W, std::span<const float> z_W,
                std::span<float> sdf_m) const noexcept override {
    decoder.decode(x_W, y_W, z_W, sdf_m);
  }
};

}  // namespace gatefield::perception
