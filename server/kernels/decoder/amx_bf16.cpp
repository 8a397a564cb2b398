// The decoder on AMX: tiled-inl.h with the real instructions. GCC 12's intrinsics say nothing of the memory that they
// read and write, hence assembly of our own. Compiled with flags of its own: nothing of the standard library here.

#include "server/kernels/decoder/tiled-inl.h"
#include "server/kernels/decoder/view.h"
// The order matters here.
#include <hwy/highway.h>

#include "server/kernels/decoder/blocks-inl.h"

static_assert(HWY_STATIC_TARGET == HWY_AVX3);

HWY_BEFORE_NAMESPACE();
namespace gatefield::kernels {
namespace HWY_NAMESPACE {
namespace amx {

struct AmxTiles {
  static HWY_INLINE void Configure() {
    // Palette 1: 16-bit row lengths in bytes from byte 16 on, 8-bit numbers of rows from byte 48 on.
    alignas(64) static constexpr std::uint8_t kPalette[64] = {
        1,  0, 0,  0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 64, 0, 64, 0, 64, 0,  64, 0,  64, 0,  64, 0,
        64, 0, 64, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,  0, 0,  0, 16, 16, 16, 16, 16, 16, 16, 16};
    asm volatile("ldtilecfg %0" : : "m"(kPalette) : "memory");
  }
  static HWY_INLINE void Release() { asm volatile("tilerelease" : : : "memory"); }
  template <int kT>
  static HWY_INLINE void Zero() {
    asm volatile("tilezero %%tmm%c0" : : "i"(kT) : "memory");
  }
  template <int kT>
  static HWY_INLINE void Load(const std::uint32_t* from) {
    asm volatile("tileloadd (%0,%1,1), %%tmm%c2" : : "r"(from), "r"(std::size_t{64}), "i"(kT) : "memory");
  }
  template <int kT>
  static HWY_INLINE void Store(float* to) {  // NOLINT(readability-non-const-parameter): the instruction writes there
    asm volatile("tilestored %%tmm%c2, (%0,%1,1)" : : "r"(to), "r"(std::size_t{64}), "i"(kT) : "memory");
  }
  template <int kC, int kA, int kB>
  static HWY_INLINE void Dot() {
    asm volatile("tdpbf16ps %%tmm%c2, %%tmm%c1, %%tmm%c0" : : "i"(kC), "i"(kA), "i"(kB) : "memory");
  }
};

struct Block {
  template <std::size_t kP>
  static HWY_NOINLINE void Run(const DecoderView& net, const float* x_W, const float* y_W, const float* z_W,
                               float* sdf) {
    const hn::FixedTag<float, 16> d;
    alignas(64) float encoded[(kMaxWidth + tiled::kTileInputs) * kP * tiled::kTile];
    alignas(64) float s[kP * tiled::kTile];
    hn::VFromD<decltype(d)> not_finite[kP];
    Encode<kP>(d, net, x_W, y_W, z_W, encoded, not_finite);
    tiled::Run<AmxTiles, kP>(net, encoded, s);
    for (std::size_t p = 0; p < kP; ++p) hn::StoreU(hn::Add(hn::Load(d, s + 16 * p), not_finite[p]), d, sdf + 16 * p);
  }
};

}  // namespace amx
}  // namespace HWY_NAMESPACE

void decode_amx_bf16(const DecoderView& net, const float* x_W, const float* y_W, const float* z_W, float* sdf,
                     std::size_t count) {
  // Loaded anew in each call, since other libraries configure tiles in the same thread, too; released, so that the
  // system has less to save at a switch of threads.
  HWY_NAMESPACE::amx::AmxTiles::Configure();
  HWY_NAMESPACE::InBlocks<HWY_NAMESPACE::amx::Block, 2, tiled::kTile>(net, x_W, y_W, z_W, sdf, count);
  HWY_NAMESPACE::amx::AmxTiles::Release();
}

}  // namespace gatefield::kernels
HWY_AFTER_NAMESPACE();
