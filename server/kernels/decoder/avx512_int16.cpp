// The decoder with VPDPWSSD (AVX512_VNNI): twice the multiplications of an FMA, in 16-bit integers. The first layer,
// which sees coordinates in metres, and the last one stay in single precision.
//
// Between them both factors are fixed-point numbers. With A = kMaxActivation, m the largest of a point's activations
// a_j, and u the layer's unit of weights:
//   q_j = round(a_j A / m) <= A,   v_ij = round(W_ij / u),   (W a)_i = u m / A sum_j v_ij q_j  (+ rounding)
// u is such that sum_j |v_ij| A < 2^31 for every neuron i (fold.cpp), so the sums are exact. Of the same 16 bits bf16
// uses 8 for the exponent; here a point's activations share one, which leaves errors 10 to 20 times as small.
//
// VPDPWSSD adds to each 32-bit lane the product of two pairs. A lane is a point, a pair two neighbouring inputs:
// activations lie as [pair of neurons][vector of points][lane], a lane holding both of the pair, and weights as pairs
// that are broadcast. Compiled with flags of its own: nothing of the standard library here.

#include <immintrin.h>

#include "server/kernels/decoder/view.h"
// The order matters here.
#include <hwy/highway.h>

#include "server/kernels/decoder/blocks-inl.h"

static_assert(HWY_STATIC_TARGET == HWY_AVX3);

HWY_BEFORE_NAMESPACE();
namespace gatefield::kernels {
namespace HWY_NAMESPACE {
namespace int16 {

constexpr std::size_t kLanes = 16;
constexpr std::size_t kNeurons = 8;

/// sum += a_even w_even + a_odd w_odd in each lane. GCC 12 copies the sums around its own _mm512_dpwssd_epi32, which
/// costs a third of the speed.
HWY_INLINE void AddProducts(__m512i& sum, __m512i a, __m512i w) {
  asm("vpdpwssd %2, %1, %0" : "+v"(sum) : "v"(a), "v"(w));
}

/// What eight neurons' sums become: the next layer's activations, or their part of the output when it comes next.
template <std::size_t kP>
HWY_INLINE void Finish(const __m512 (&sums)[kNeurons][kP], const LayerView* output, std::size_t n, float* next,
                       __m512 (&largest)[kP], __m512 (&s)[kP]) {
  for (std::size_t j = 0; j < kNeurons; ++j) {
    const __m512 w = _mm512_set1_ps(output != nullptr && n + j < output->inputs ? output->weight[4 * (n + j)] : 0.0f);
    for (std::size_t p = 0; p < kP; ++p) {
      const __m512 a = _mm512_max_ps(sums[j][p], _mm512_setzero_ps());
      if (output != nullptr) {
        s[p] = _mm512_fmadd_ps(w, a, s[p]);
      } else {
        largest[p] = _mm512_max_ps(largest[p], a);
        _mm512_store_ps(next + ((n + j) * kP + p) * kLanes, a);
      }
    }
  }
}

struct Block {
  template <std::size_t kP>
  static HWY_NOINLINE void Run(const DecoderView& net, const float* x_W, const float* y_W, const float* z_W,
                               float* sdf) {
    const hn::FixedTag<float, kLanes> d;
    alignas(64) float activations[kMaxWidth * kP * kLanes];
    alignas(64) float encoded[kMaxWidth * kP * kLanes];
    alignas(64) __m512i fixed[kMaxWidth / 2 * kP];
    hn::VFromD<decltype(d)> not_finite[kP];
    Encode<kP>(d, net, x_W, y_W, z_W, encoded, not_finite);

    const LayerView& output = net.layers[net.layer_count - 1];
    __m512 s[kP], largest[kP];
    for (std::size_t p = 0; p < kP; ++p) {
      s[p] = _mm512_set1_ps(output.bias[0]);
      largest[p] = _mm512_setzero_ps();
    }

    const LayerView& first = net.layers[0];
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
      Finish<kP>(sums, nullptr, n, activations, largest, s);
    }

    for (std::size_t l = 1; l + 1 < net.layer_count; ++l) {
      const LayerView& layer = net.layers[l];
      const std::size_t pairs = (layer.inputs + 1) / 2;
      __m512 unit[kP];
      for (std::size_t p = 0; p < kP; ++p) {
        const __m512 most = _mm512_max_ps(largest[p], _mm512_set1_ps(1e-30f));
        const __m512 up = _mm512_div_ps(_mm512_set1_ps(kMaxActivation), most);
        unit[p] = _mm512_mul_ps(most, _mm512_set1_ps(layer.unit / kMaxActivation));
        largest[p] = _mm512_setzero_ps();
        // Added to 2^23 a number below 2^16 is rounded to a whole one, which is then the lower half of the sum's bits.
        const __m512 whole = _mm512_set1_ps(0x1p23f);
        for (std::size_t k = 0; k < pairs; ++k) {
          const float* a = activations + (2 * k * kP + p) * kLanes;
          const __m512i even = _mm512_castps_si512(_mm512_fmadd_ps(_mm512_load_ps(a), up, whole));
          const __m512i odd = _mm512_castps_si512(_mm512_fmadd_ps(_mm512_load_ps(a + kP * kLanes), up, whole));
          fixed[k * kP + p] = _mm512_mask_blend_epi16(0xaaaaaaaau, even, _mm512_slli_epi32(odd, 16));
        }
      }
      const LayerView* const last = l + 2 == net.layer_count ? &output : nullptr;
      for (std::size_t n = 0; n < layer.outputs; n += kNeurons) {
        const std::uint32_t* group = layer.pairs + n * pairs;
        __m512i whole_sums[kNeurons][kP];
        for (std::size_t j = 0; j < kNeurons; ++j)
          for (std::size_t p = 0; p < kP; ++p) whole_sums[j][p] = _mm512_setzero_si512();
        for (std::size_t k = 0; k < pairs; ++k) {
          __m512i a[kP];
          for (std::size_t p = 0; p < kP; ++p) a[p] = fixed[k * kP + p];
          for (std::size_t j = 0; j < kNeurons; ++j) {
            const __m512i w = _mm512_set1_epi32(static_cast<int>(group[kNeurons * k + j]));
            for (std::size_t p = 0; p < kP; ++p) AddProducts(whole_sums[j][p], a[p], w);
          }
        }
        __m512 sums[kNeurons][kP];
        for (std::size_t j = 0; j < kNeurons; ++j) {
          const __m512 bias = _mm512_set1_ps(layer.bias[n + j]);
          for (std::size_t p = 0; p < kP; ++p)
            sums[j][p] = _mm512_fmadd_ps(_mm512_cvtepi32_ps(whole_sums[j][p]), unit[p], bias);
        }
        Finish<kP>(sums, last, n, activations, largest, s);
      }
    }
    for (std::size_t p = 0; p < kP; ++p) _mm512_storeu_ps(sdf + p * kLanes, _mm512_add_ps(s[p], not_finite[p].raw));
  }
};

}  // namespace int16
}  // namespace HWY_NAMESPACE

void decode_avx512_int16(const DecoderView& net, const float* x_W, const float* y_W, const float* z_W, float* sdf,
                         std::size_t count) {
  HWY_NAMESPACE::InBlocks<HWY_NAMESPACE::int16::Block, 2, HWY_NAMESPACE::int16::kLanes>(net, x_W, y_W, z_W, sdf, count);
}

}  // namespace gatefield::kernels
HWY_AFTER_NAMESPACE();
