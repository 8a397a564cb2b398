#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/model/bundle.h"

/// Field decoder: s = g_phi(z, p) for many points p and one z (paper, "Gate-SDF Guided Safety Cost").
///
/// With z fixed the first layer is affine in the encoding e(p) of the point, so it is folded once per frame:
///   a0 = e(p)  (p itself, or p and its sines and cosines),   a1 = relu(W1 a0 + b1),   a_{i+1} = relu(W_i a_i + b_i),   s = w a_n + b.
/// Tolerance of every instruction set against reference.cpp: |ds| <= 1e-4 m with trained weights (fp32).
namespace gatefield::kernels {

/// A decoder with its latent folded in. Folding allocates on first use only; layouts are padded for the widest vectors.
struct FoldedDecoder {
  int encoding_octaves = 0;
  float inverse_scale = 1.0f;      ///< 1 / S
  Eigen::Matrix3f R_CW = Eigen::Matrix3f::Identity();
  Eigen::Vector3f t_CW = Eigen::Vector3f::Zero();  ///< p_C = R_CW p_W + t_CW; kHyper: minus the latent's centre already
  std::vector<model::Dense> layers;                ///< [0] folded
};

/// Folds `latent` (captured from X_WC) into `out`. Reuses out's memory.
/// @pre latent.size() == weights.latent_size
void fold(const model::DecoderWeights& weights, std::span<const float> latent, const Eigen::Isometry3d& X_WC, FoldedDecoder* out);

/// s at points in the world frame; double precision, readable: what the instruction sets are held against.
void decode_reference(const FoldedDecoder& decoder, std::span<const float> x_W, std::span<const float> y_W,
                      std::span<const float> z_W, std::span<float> sdf_m) noexcept;

/// The same through the best instruction set (or the forced one). Any number of points.
/// Thread-safe: yes.   Real-time safe: yes (scratch is on the stack; hidden layers up to 256 wide).
void decode(const FoldedDecoder& decoder, std::span<const float> x_W, std::span<const float> y_W, std::span<const float> z_W,
            std::span<float> sdf_m) noexcept;

}  // namespace gatefield::kernels
