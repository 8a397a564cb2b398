// What the decoder's kernels share: how points are cut into blocks, and what the first layer gets. Include it after
// hwy/highway.h.

#if defined(GATEFIELD_KERNELS_DECODER_BLOCKS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef GATEFIELD_KERNELS_DECODER_BLOCKS_INL_H_
#undef GATEFIELD_KERNELS_DECODER_BLOCKS_INL_H_
#else
#define GATEFIELD_KERNELS_DECODER_BLOCKS_INL_H_
#endif

#include <hwy/highway.h>

#include "server/kernels/decoder/view.h"
#include "server/kernels/math-inl.h"

HWY_BEFORE_NAMESPACE();
namespace gatefield::kernels {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

/// kP vectors of world points to the network's inputs: camera coordinates, then sine and cosine of each octave.
/// @param in          [input][kP][lane], aligned
/// @param not_finite  0 for points with finite coordinates, else NaN
template <std::size_t kP, class D, class V = hn::VFromD<D>>
HWY_INLINE void Encode(D d, const DecoderView& net, const float* x_W, const float* y_W, const float* z_W,
                       float* HWY_RESTRICT in, V (&not_finite)[kP]) {
  constexpr std::size_t kStride = hn::MaxLanes(D());
  const V zero = hn::Zero(d);
  HWY_UNROLL(4)
  for (std::size_t p = 0; p < kP; ++p) {
    const V x = hn::LoadU(d, x_W + p * kStride), y = hn::LoadU(d, y_W + p * kStride),
            z = hn::LoadU(d, z_W + p * kStride);
    not_finite[p] = hn::MulAdd(x, zero, hn::MulAdd(y, zero, hn::Mul(z, zero)));
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const float* R = net.R_CW + 3 * axis;
      V c = hn::MulAdd(hn::Set(d, R[0]), x, hn::Set(d, net.t_CW[axis]));
      c = hn::MulAdd(hn::Set(d, R[1]), y, c);
      c = hn::MulAdd(hn::Set(d, R[2]), z, c);
      c = hn::Min(hn::Max(c, hn::Set(d, -net.max_coordinate)), hn::Set(d, net.max_coordinate));
      hn::Store(c, d, in + (axis * kP + p) * kStride);
      if (net.octaves == 0) continue;
      // One sine and cosine per axis; every further octave by the double angle.
      V sine, cosine;
      SinCosTurns(d, hn::Mul(c, hn::Set(d, net.half_inverse_scale)), sine, cosine);
      for (std::size_t octave = 0; octave < net.octaves; ++octave) {
        const std::size_t row = 3 + 6 * octave + axis;
        hn::Store(sine, d, in + (row * kP + p) * kStride);
        hn::Store(cosine, d, in + ((row + 3) * kP + p) * kStride);
        const V twice = hn::Add(sine, sine);
        const V next_cosine = hn::NegMulAdd(twice, sine, hn::Set(d, 1.0f));
        sine = hn::Mul(twice, cosine);
        cosine = next_cosine;
      }
    }
  }
}

/// Any number of points through Block::Run<vectors>(): kVectors vectors at a time, then single ones, the last of them
/// filled up.
template <class Block, std::size_t kVectors, std::size_t kLanesPerVector>
HWY_INLINE void InBlocks(const DecoderView& net, const float* x_W, const float* y_W, const float* z_W, float* sdf,
                         std::size_t count) {
  std::size_t n = 0;
  for (; n + kVectors * kLanesPerVector <= count; n += kVectors * kLanesPerVector)
    Block::template Run<kVectors>(net, x_W + n, y_W + n, z_W + n, sdf + n);
  for (; n + kLanesPerVector <= count; n += kLanesPerVector)
    Block::template Run<1>(net, x_W + n, y_W + n, z_W + n, sdf + n);
  if (n < count) {
    float part[4][kLanesPerVector] = {};
    for (std::size_t i = 0; n + i < count; ++i) {
      part[0][i] = x_W[n + i];
      part[1][i] = y_W[n + i];
      part[2][i] = z_W[n + i];
    }
    Block::template Run<1>(net, part[0], part[1], part[2], part[3]);
    for (std::size_t i = 0; n + i < count; ++i) sdf[n + i] = part[3][i];
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace gatefield::kernels
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
