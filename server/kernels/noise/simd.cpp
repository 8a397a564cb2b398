#include "server/kernels/noise/noise.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "server/kernels/noise/simd.cpp"
// The order matters here.
// clang-format off
#include <hwy/foreach_target.h>
#include <hwy/highway.h>
#include <hwy/contrib/math/math-inl.h>
// clang-format on

#include "server/kernels/math-inl.h"
#include "server/kernels/target.h"

HWY_BEFORE_NAMESPACE();
namespace gatefield::kernels {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
using D = hn::ScalableTag<float>;
using DU = hn::RebindToUnsigned<D>;
using V = hn::VFromD<D>;
using VU = hn::VFromD<DU>;

/// high, low = upper and lower half of the 64-bit product of every lane with `factor`.
HWY_INLINE void WideProduct(VU value, std::uint32_t factor, VU& high, VU& low) {
  const DU du;
#if HWY_TARGET == HWY_SCALAR
  const std::uint64_t product = std::uint64_t{hn::GetLane(value)} * factor;
  high = hn::Set(du, static_cast<std::uint32_t>(product >> 32));
  low = hn::Set(du, static_cast<std::uint32_t>(product));
#else
  // The multiplier takes even lanes only: the odd ones are shifted down and their products interleaved again.
  const hn::RepartitionToWide<DU> dw;
  const VU factors = hn::Set(du, factor);
  const auto even = hn::MulEven(value, factors);
  const auto odd = hn::MulEven(hn::BitCast(du, hn::ShiftRight<32>(hn::BitCast(dw, value))), factors);
  high = hn::OddEven(hn::BitCast(du, odd), hn::BitCast(du, hn::ShiftRight<32>(even)));
  low = hn::OddEven(hn::BitCast(du, hn::ShiftLeft<32>(odd)), hn::BitCast(du, even));
#endif
}

/// Philox4x32-10 (common/base/random.h), one counter per lane.
HWY_INLINE void Philox(VU counter[4], std::uint32_t key0, std::uint32_t key1) {
  const DU du;
  HWY_UNROLL(10)
  for (int round = 0; round < 10; ++round) {
    VU high0, low0, high1, low1;
    WideProduct(counter[0], 0xD2511F53u, high0, low0);
    WideProduct(counter[2], 0xCD9E8D57u, high1, low1);
    counter[0] = hn::Xor(hn::Xor(high1, counter[1]), hn::Set(du, key0));
    counter[1] = low1;
    counter[2] = hn::Xor(hn::Xor(high0, counter[3]), hn::Set(du, key1));
    counter[3] = low0;
    key0 += 0x9E3779B9u;
    key1 += 0xBB67AE85u;
  }
}

/// Box-Muller: two normals from two words of random bits.
HWY_INLINE void Normals(VU bits_radius, VU bits_angle, V& first, V& second) {
  const D d;
  const hn::RebindToSigned<D> di;
  // In (0, 1), both ends left out, every value exact: (2 j + 1) 2^-24.
  const V unit = hn::MulAdd(hn::ConvertTo(d, hn::BitCast(di, hn::ShiftRight<9>(bits_radius))), hn::Set(d, 0x1p-23f),
                            hn::Set(d, 0x1p-24f));
  const V turns = hn::Mul(hn::ConvertTo(d, hn::BitCast(di, hn::ShiftRight<8>(bits_angle))), hn::Set(d, 0x1p-24f));
  // The logarithm's own rounding could make a result just above zero near 1.
  const V square = hn::Max(hn::Mul(hn::Set(d, -2.0f), hn::Log(d, unit)), hn::Zero(d));
  const V radius = hn::Sqrt(square);
  V sine, cosine;
  SinCosTurns(d, turns, sine, cosine);
  first = hn::Mul(radius, cosine);
  second = hn::Mul(radius, sine);
}

void SampleAll(const float* factors, std::uint64_t key, std::uint64_t step, std::uint32_t first_sample,
               const float* mean, const SampleBlock& inputs) {
  const D d;
  const DU du;
  const std::size_t N = hn::Lanes(d);
  const std::size_t lanes = static_cast<std::size_t>(padded_samples(inputs.samples));
  for (int k = 0; k < inputs.steps; ++k) {
    float* row[kInputs];
    for (int i = 0; i < kInputs; ++i) row[i] = inputs.row(k, i);
    const float* mean_k = mean + static_cast<std::size_t>(k) * kInputs;
    for (std::size_t m = 0; m < lanes; m += N) {
      const VU index = hn::Iota(du, first_sample + static_cast<std::uint32_t>(m));
      VU bits[4] = {index, hn::Set(du, static_cast<std::uint32_t>(k)), hn::Set(du, static_cast<std::uint32_t>(step)),
                    hn::Set(du, static_cast<std::uint32_t>(step >> 32))};
      Philox(bits, static_cast<std::uint32_t>(key), static_cast<std::uint32_t>(key >> 32));
      V n[4];
      Normals(bits[0], bits[1], n[0], n[1]);
      Normals(bits[2], bits[3], n[2], n[3]);
      const auto plan_itself = hn::RebindMask(d, hn::Eq(index, hn::Zero(du)));
      for (V& each : n) each = hn::IfThenZeroElse(plan_itself, each);
      for (std::size_t i = 0; i < kInputs; ++i) {
        V u = hn::Set(d, mean_k[i]);
        for (std::size_t j = 0; j < 4; ++j) u = hn::MulAdd(hn::Set(d, factors[4 * i + j]), n[j], u);
        hn::StoreU(u, d, row[i] + m);
      }
    }
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace gatefield::kernels
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace gatefield::kernels {

HWY_EXPORT(SampleAll);

SampleLoop* sample_loop(std::int64_t target) noexcept { return GATEFIELD_OF_TARGET(SampleAll, target); }

void sample(SampleLoop* loop, const NoiseShape& shape, std::uint64_t key, std::uint64_t step, int first_sample,
            const float* mean, SampleBlock inputs) noexcept {
  float factors[16];
  for (std::size_t i = 0; i < 4; ++i) {
    for (std::size_t j = 0; j < 4; ++j) factors[4 * i + j] = shape.mixer[i][j] * shape.sigma[j];
  }
  loop(factors, key, step, static_cast<std::uint32_t>(first_sample), mean, inputs);
}

}  // namespace gatefield::kernels
#endif  // HWY_ONCE
