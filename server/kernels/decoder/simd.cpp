#include "server/kernels/decoder/view.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "server/kernels/decoder/simd.cpp"
#include <hwy/foreach_target.h>  // must come before highway.h
#include <hwy/highway.h>

#include "server/kernels/decoder/blocks-inl.h"
#include "server/kernels/target.h"

HWY_BEFORE_NAMESPACE();
namespace gatefield::kernels {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
using D = hn::ScalableTag<float>;
using V = hn::VFromD<D>;
constexpr std::size_t kLanes = hn::MaxLanes(D());

// A block is kVectors vectors of points; the inner loop keeps kVectors x kNeurons sums in registers. Enough of them to
// hide the latency of the multiplier (8 to 10), few enough to stay within the register file together with a weight and
// the inputs.
#if HWY_TARGET <= HWY_AVX3 || HWY_TARGET == HWY_NEON
constexpr std::size_t kVectors = 2, kNeurons = 8;  // 32 registers
#elif HWY_TARGET == HWY_AVX2
constexpr std::size_t kVectors = 3, kNeurons = 4;  // 16 registers
#else
constexpr std::size_t kVectors = 2, kNeurons = 4;
#endif

/// kNeurons (kN) outputs of one layer for kP vectors of points: sums[j][p] = b[n + j] + sum_k W[n + j][k] in[k][p].
template <std::size_t kP, std::size_t kN>
HWY_INLINE void Affine(const LayerView& layer, std::size_t n, const float* HWY_RESTRICT in, V (&sums)[kN][kP]) {
  static_assert(kN == 4 || kN == 8);
  const D d;
  const float* HWY_RESTRICT group0 = layer.weight + n * layer.inputs;
  const float* HWY_RESTRICT group1 = group0 + (kN == 8 ? 4 * layer.inputs : 0);
  HWY_UNROLL(8)
  for (std::size_t j = 0; j < kN; ++j) {
    HWY_UNROLL(4)
    for (std::size_t p = 0; p < kP; ++p) sums[j][p] = hn::Set(d, layer.bias[n + j]);
  }
  for (std::size_t k = 0; k < layer.inputs; ++k) {
    V a[kP];
    HWY_UNROLL(4)
    for (std::size_t p = 0; p < kP; ++p) a[p] = hn::Load(d, in + (k * kP + p) * kLanes);
    HWY_UNROLL(8)
    for (std::size_t j = 0; j < kN; ++j) {
      const V w = hn::Set(d, j < 4 ? group0[4 * k + j] : group1[4 * k + j - 4]);
      HWY_UNROLL(4)
      for (std::size_t p = 0; p < kP; ++p) sums[j][p] = hn::MulAdd(w, a[p], sums[j][p]);
    }
  }
}

/// The network for kP vectors of points. Activations lie as [neuron][kP][lane]; two buffers take turns, and the last
/// hidden layer goes straight into the output's sum without being stored.
template <std::size_t kP, std::size_t kN>
HWY_NOINLINE void DecodeBlock(const DecoderView& net, const float* x_W, const float* y_W, const float* z_W,
                              float* sdf) {
  const D d;
  HWY_ALIGN_MAX float buffers[2][kMaxWidth * kP * kLanes];
  float* in = buffers[0];
  float* out = buffers[1];
  const V zero = hn::Zero(d);

  V not_finite[kP];
  Encode<kP>(d, net, x_W, y_W, z_W, in, not_finite);

  const LayerView& output = net.layers[net.layer_count - 1];
  V s[kP];
  HWY_UNROLL(4)
  for (std::size_t p = 0; p < kP; ++p) s[p] = hn::Set(d, output.bias[0]);

  const std::size_t hidden_layers = net.layer_count - 1;
  for (std::size_t l = 0; l < hidden_layers; ++l) {
    const LayerView& layer = net.layers[l];
    const bool last_hidden = l + 1 == hidden_layers;
    for (std::size_t n = 0; n < layer.outputs; n += kN) {
      V sums[kN][kP];
      Affine<kP, kN>(layer, n, in, sums);
      if (last_hidden) {
        // A packed layer has groups of four outputs side by side, so output 0 has every fourth number. The neurons that
        // fill up the last group are zero and have no weight: the sum ends at the real ones.
        HWY_UNROLL(8)
        for (std::size_t j = 0; j < kN; ++j) {
          const V w = hn::Set(d, n + j < output.inputs ? output.weight[4 * (n + j)] : 0.0f);
          HWY_UNROLL(4)
          for (std::size_t p = 0; p < kP; ++p) s[p] = hn::MulAdd(w, hn::Max(sums[j][p], zero), s[p]);
        }
      } else {
        HWY_UNROLL(8)
        for (std::size_t j = 0; j < kN; ++j) {
          HWY_UNROLL(4)
          for (std::size_t p = 0; p < kP; ++p)
            hn::Store(hn::Max(sums[j][p], zero), d, out + ((n + j) * kP + p) * kLanes);
        }
      }
    }
    float* swap = in;
    in = out;
    out = swap;
  }
  if (hidden_layers == 0) {
    for (std::size_t k = 0; k < output.inputs; ++k) {
      const V w = hn::Set(d, output.weight[4 * k]);
      HWY_UNROLL(4)
      for (std::size_t p = 0; p < kP; ++p) s[p] = hn::MulAdd(w, hn::Load(d, in + (k * kP + p) * kLanes), s[p]);
    }
  }
  HWY_UNROLL(4)
  for (std::size_t p = 0; p < kP; ++p) hn::StoreU(hn::Add(s[p], not_finite[p]), d, sdf + p * kLanes);
}

struct Block {
  /// A vector that comes alone has no second one to share weights with: more neurons at a time instead.
  template <std::size_t kP>
  static HWY_INLINE void Run(const DecoderView& net, const float* x_W, const float* y_W, const float* z_W, float* sdf) {
    DecodeBlock<kP, kP == 1 ? 8 : kNeurons>(net, x_W, y_W, z_W, sdf);
  }
};

void DecodeAll(const DecoderView& net, const float* x_W, const float* y_W, const float* z_W, float* sdf,
               std::size_t count) {
  InBlocks<Block, kVectors, kLanes>(net, x_W, y_W, z_W, sdf, count);
}

}  // namespace HWY_NAMESPACE
}  // namespace gatefield::kernels
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace gatefield::kernels {

HWY_EXPORT(DecodeAll);

DecodeLoop* decode_loop(std::int64_t target) noexcept { return GATEFIELD_OF_TARGET(DecodeAll, target); }

}  // namespace gatefield::kernels
#endif  // HWY_ONCE
