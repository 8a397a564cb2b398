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
///   a0 = e(p)  (p itself, or p and its sines and cosines),   a1 = relu(W1 a0 + b1),   a_{i+1} = relu(W_i a_i + b_i),
///   s = w a_n + b.
/// Tolerance against reference.cpp with trained weights: |ds| <= 1e-4 m in single precision. Where the layers between
/// the first and the last are in 16-bit fixed point (avx3_int16, avx512_int16.cpp) it is 0.004 m within 10 m of the
/// gate, as far as the planner asks: at most 0.0023 m was measured, 0.0001 to 0.0004 m rms; it grows with the distance.
/// On AMX tiles (avx3_amx,
/// tiled-inl.h) it is 0.001 m there; 0.00015 m was measured with emulated tiles.
namespace gatefield::kernels {

/// Limits of what decode() takes; model::Bundle checks them.
inline constexpr int kMaxWidth = 256;   ///< inputs and outputs of any layer after folding
inline constexpr int kMaxOctaves = 16;  ///< of the positional encoding
/// Coordinates in the camera frame saturate here, so that any finite point gives a finite value.
inline constexpr double kMaxCoordinate_m = 1e6;

/// One layer laid out for decode(): outputs filled up to a multiple of kNeuronGroup with zeros, then in groups of four
/// weight[group][input][4], so that the inner loop reads one stream per group.
struct PackedLayer {
  int inputs = 0;
  int outputs = 0;  ///< padded
  std::vector<float> weight;
  std::vector<float> bias;
  /// Two inputs' weights as 16-bit multiples of `unit`, the even one in the lower half, [group of kNeuronGroup][pair of
  /// inputs][neuron]; empty on machines that don't multiply them, and for the first layer.
  std::vector<std::uint32_t> pairs;
  float unit = 0.0f;
  /// Weights as AMX takes them (tiled-inl.h), [block of 16 outputs][step of 32 inputs][hi, lo][output][input] in bf16,
  /// and biases filled up; empty on machines without AMX, and for the last layer.
  std::vector<std::uint32_t> tiles;
  std::vector<float> tile_bias;
};
inline constexpr int kNeuronGroup = 8;

/// A decoder with its latent folded in. Folding allocates on first use only.
struct FoldedDecoder {
  int encoding_octaves = 0;
  float inverse_scale = 1.0f;  ///< 1 / S of the sines; kHyper has it in its first layer's weights
  Eigen::Matrix3f R_CW = Eigen::Matrix3f::Identity();
  Eigen::Vector3f t_CW = Eigen::Vector3f::Zero();  ///< p_C = R_CW p_W + t_CW; kHyper: minus the latent's centre already
  std::vector<model::Dense> layers;                ///< [0] folded
  std::vector<PackedLayer> packed;                 ///< the same as decode() reads them
};

/// Folds `latent` (captured from X_WC) into `out`. Reuses out's memory.
/// Not thread-safe on the same `out`; real-time safe from the second call with weights of the same shape on.
/// @pre latent.size() == weights.latent_size; weights as model::Bundle lets them through (shapes chain, widths <=
/// kMaxWidth)
void fold(const model::DecoderWeights& weights, std::span<const float> latent, const Eigen::Isometry3d& X_WC,
          FoldedDecoder* out);

/// Fills in `tiles`. fold() does by itself where the machine has AMX.
void lay_out_tiles(FoldedDecoder* decoder);

/// s at points in the world frame; double precision, readable: what the instruction sets are held against.
void decode_reference(const FoldedDecoder& decoder, std::span<const float> x_W, std::span<const float> y_W,
                      std::span<const float> z_W, std::span<float> sdf_m) noexcept;

/// Largest |ds| against the reference with trained weights, by the instruction set in use.
double decode_tolerance_m() noexcept;

/// The same through the best instruction set (or the forced one). Any number of points; a point with a coordinate that
/// isn't finite gets NaN. A point's value doesn't depend on its place in the span. Thread-safe: yes.   Real-time safe:
/// yes (scratch is on the stack; hidden layers up to 256 wide).
void decode(const FoldedDecoder& decoder, std::span<const float> x_W, std::span<const float> y_W,
            std::span<const float> z_W, std::span<float> sdf_m) noexcept;

}  // namespace gatefield::kernels
