// The decoder with VDPBF16PS: twice the multiplications of an FMA. The first layer, which sees coordinates in metres,
// and the last one stay in single precision; between them activations and weights are bf16, sums single precision.
//
// VDPBF16PS adds to each single-precision lane the product of two pairs of bf16. A lane is a point, a pair two
// neighbouring inputs: activations lie as [pair of neurons][vector of points][lane], a lane holding both of the pair,
// and weights as 32-bit pairs that are broadcast. Compiled with flags of its own: nothing of the standard library here.

#include <immintrin.h>

#include "server/kernels/decoder/view.h"
// The order matters here.
#include <hwy/highway.h>

#include "server/kernels/decoder/encode-inl.h"

static_assert(HWY_STATIC_TARGET == HWY_AVX3);

HWY_BEFORE_NAMESPACE();
namespace gatefield::kernels {
namespace HWY_NAMESPACE {
namespace bf16 {

using D = hn::FixedTag<float, 16>;
using V = hn::VFromD<D>;
constexpr std::size_t kLanes = 16;
constexpr std::size_t kNeurons = 8;

/// relu of two neurons as a pair of bf16 per lane, rounded to nearest.
HWY_INLINE __m512i Pair(__m512 low, __m512 high, __m512i interleave) {
  const __m512 zero = _mm512_setzero_ps();
  const __m512bh both = _mm512_cvtne2ps_pbh(_mm512_max_ps(high, zero), _mm512_max_ps(low, zero));
  __m512i bits;
  __builtin_memcpy(&bits, &both, sizeof bits);
  return _mm512_permutexvar_epi16(interleave, bits);
}

HWY_INLINE __m512bh AsPairs(__m512i bits) {
  __m512bh pairs;
  __builtin_memcpy(&pairs, &bits, sizeof pairs);
  return pairs;
}

/// What eight neurons' sums become: the next layer's input, or their part of the output when it comes next.
template <std::size_t kP>
HWY_INLINE void Finish(const __m512 (&sums)[kNeurons][kP], const LayerView* output, std::size_t n, __m512i interleave,
                       __m512i* next, __m512 (&s)[kP]) {
  if (output == nullptr) {
    for (std::size_t j = 0; j < kNeurons; j += 2) {
      for (std::size_t p = 0; p < kP; ++p)
        _mm512_store_si512(next + (n + j) / 2 * kP + p, Pair(sums[j][p], sums[j + 1][p], interleave));
    }
    return;
  }
  for (std::size_t j = 0; j < kNeurons; ++j) {
    const __m512 w = _mm512_set1_ps(n + j < output->inputs ? output->weight[4 * (n + j)] : 0.0f);
    for (std::size_t p = 0; p < kP; ++p)
      s[p] = _mm512_fmadd_ps(w, _mm512_max_ps(sums[j][p], _mm512_setzero_ps()), s[p]);
  }
}

template <std::size_t kP>
HWY_NOINLINE void DecodeBlock(const DecoderView& net, const float* x_W, const float* y_W, const float* z_W,
                              float* sdf) {
  const D d;
  alignas(64) float encoded[kMostInputs * kP * kLanes];
  alignas(64) __m512i buffers[2][kMostInputs / 2 * kP];
  V not_finite[kP];
  Encode<kP>(d, net, x_W, y_W, z_W, encoded, not_finite);

  alignas(64) static constexpr std::uint16_t kInterleave[32] = {0,  16, 1,  17, 2,  18, 3,  19, 4,  20, 5,
                                                                21, 6,  22, 7,  23, 8,  24, 9,  25, 10, 26,
                                                                11, 27, 12, 28, 13, 29, 14, 30, 15, 31};
  const __m512i interleave = _mm512_load_si512(kInterleave);
  const LayerView& output = net.layers[net.layer_count - 1];
  __m512 s[kP];
  for (std::size_t p = 0; p < kP; ++p) s[p] = _mm512_set1_ps(output.bias[0]);

  const LayerView& first = net.layers[0];
  __m512i* in = buffers[0];
  __m512i* out = buffers[1];
  for (std::size_t n = 0; n < first.outputs; n += kNeurons) {
    const float* group0 = first.weight + n * first.inputs;
    const float* group1 = group0 + 4 * first.inputs;
    __m512 sums[kNeurons][kP];
    for (std::size_t j = 0; j < kNeurons; ++j)
      for (std::size_t p = 0; p < kP; ++p) sums[j][p] = _mm512_set1_ps(first.bias[n + j]);
    for (std::size_t k = 0; k < first.inputs; ++k) {
      for (std::size_t j = 0; j < kNeurons; ++j) {
        const __m512 w = _mm512_set1_ps(j < 4 ? group0[4 * k + j] : group1[4 * k + j - 4]);
        for (std::size_t p = 0; p < kP; ++p)
          sums[j][p] = _mm512_fmadd_ps(w, _mm512_load_ps(encoded + (k * kP + p) * kLanes), sums[j][p]);
      }
    }
    Finish<kP>(sums, nullptr, n, interleave, in, s);
  }

  for (std::size_t l = 1; l + 1 < net.layer_count; ++l) {
    const LayerView& layer = net.layers[l];
    const std::size_t pairs = (layer.inputs + 1) / 2;
    const LayerView* const last = l + 2 == net.layer_count ? &output : nullptr;
    for (std::size_t n = 0; n < layer.outputs; n += kNeurons) {
      const std::uint32_t* group = layer.pairs + n * pairs;
      __m512 sums[kNeurons][kP];
      for (std::size_t j = 0; j < kNeurons; ++j)
        for (std::size_t p = 0; p < kP; ++p) sums[j][p] = _mm512_set1_ps(layer.bias[n + j]);
      for (std::size_t k = 0; k < pairs; ++k) {
        __m512bh a[kP];
        for (std::size_t p = 0; p < kP; ++p) a[p] = AsPairs(_mm512_load_si512(in + k * kP + p));
        for (std::size_t j = 0; j < kNeurons; ++j) {
          const __m512bh w = AsPairs(_mm512_set1_epi32(static_cast<int>(group[kNeurons * k + j])));
          for (std::size_t p = 0; p < kP; ++p) sums[j][p] = _mm512_dpbf16_ps(sums[j][p], a[p], w);
        }
      }
      Finish<kP>(sums, last, n, interleave, out, s);
    }
    __m512i* const swap = in;
    in = out;
    out = swap;
  }
  for (std::size_t p = 0; p < kP; ++p) _mm512_storeu_ps(sdf + p * kLanes, _mm512_add_ps(s[p], not_finite[p].raw));
}

void DecodeAll(const DecoderView& net, const float* x_W, const float* y_W, const float* z_W, float* sdf,
               std::size_t count) {
  constexpr std::size_t kVectors = 2;
  std::size_t n = 0;
  for (; n + kVectors * kLanes <= count; n += kVectors * kLanes)
    DecodeBlock<kVectors>(net, x_W + n, y_W + n, z_W + n, sdf + n);
  for (; n + kLanes <= count; n += kLanes) DecodeBlock<1>(net, x_W + n, y_W + n, z_W + n, sdf + n);
  if (n < count) {
    float part[4][kLanes] = {};
    for (std::size_t i = 0; n + i < count; ++i) {
      part[0][i] = x_W[n + i];
      part[1][i] = y_W[n + i];
      part[2][i] = z_W[n + i];
    }
    DecodeBlock<1>(net, part[0], part[1], part[2], part[3]);
    for (std::size_t i = 0; n + i < count; ++i) sdf[n + i] = part[3][i];
  }
}

}  // namespace bf16
}  // namespace HWY_NAMESPACE

void decode_avx512_bf16(const DecoderView& net, const float* x_W, const float* y_W, const float* z_W, float* sdf,
                        std::size_t count) noexcept {
  HWY_NAMESPACE::bf16::DecodeAll(net, x_W, y_W, z_W, sdf, count);
}

}  // namespace gatefield::kernels
HWY_AFTER_NAMESPACE();
