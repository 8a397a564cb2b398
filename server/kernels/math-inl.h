// Polynomials that several kernels share, compiled once per instruction set. Include it after hwy/highway.h.

#if defined(GATEFIELD_KERNELS_MATH_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef GATEFIELD_KERNELS_MATH_INL_H_
#undef GATEFIELD_KERNELS_MATH_INL_H_
#else
#define GATEFIELD_KERNELS_MATH_INL_H_
#endif

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace gatefield::kernels {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

/// sine = sin(2 pi t), cosine = cos(2 pi t); t in turns, so that the reduction to an eighth of a turn is exact.
/// Error below 1e-7 for |t| < 2^20. Taylor series: on [-pi/4, pi/4] the first terms left out are below 2e-9.
template <class D, class V = hn::VFromD<D>>
HWY_INLINE void SinCosTurns(D d, V turns, V& sine, V& cosine) {
  const hn::RebindToSigned<D> di;
  const V quarters = hn::Mul(turns, hn::Set(d, 4.0f));
  const V nearest = hn::Round(quarters);
  const auto quadrant = hn::ConvertTo(di, nearest);
  const V a = hn::Mul(hn::Sub(quarters, nearest), hn::Set(d, 1.57079632679f));
  const V a2 = hn::Mul(a, a);
  V s = hn::MulAdd(a2, hn::Set(d, 1.0f / 362880), hn::Set(d, -1.0f / 5040));
  s = hn::MulAdd(s, a2, hn::Set(d, 1.0f / 120));
  s = hn::MulAdd(s, a2, hn::Set(d, -1.0f / 6));
  s = hn::MulAdd(hn::Mul(s, a2), a, a);
  V c = hn::MulAdd(a2, hn::Set(d, -1.0f / 3628800), hn::Set(d, 1.0f / 40320));
  c = hn::MulAdd(c, a2, hn::Set(d, -1.0f / 720));
  c = hn::MulAdd(c, a2, hn::Set(d, 1.0f / 24));
  c = hn::MulAdd(c, a2, hn::Set(d, -0.5f));
  c = hn::MulAdd(c, a2, hn::Set(d, 1.0f));
  // Quadrant q turns (s, c) by q quarters: odd ones swap, bit 1 of q (of q + 1) negates the sine (the cosine).
  const auto one = hn::Set(di, 1);
  const auto swap = hn::MaskFromVec(hn::BitCast(d, hn::Neg(hn::And(quadrant, one))));
  const V sine_sign = hn::BitCast(d, hn::ShiftLeft<30>(hn::And(quadrant, hn::Set(di, 2))));
  const V cosine_sign = hn::BitCast(d, hn::ShiftLeft<30>(hn::And(hn::Add(quadrant, one), hn::Set(di, 2))));
  sine = hn::Xor(hn::IfThenElse(swap, c, s), sine_sign);
  cosine = hn::Xor(hn::IfThenElse(swap, s, c), cosine_sign);
}

}  // namespace HWY_NAMESPACE
}  // namespace gatefield::kernels
HWY_AFTER_NAMESPACE();

#endif  // include guard that toggles with every target
