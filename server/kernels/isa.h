#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"

namespace gatefield::kernels {

/// Instruction sets that this build has and this machine can run, best first, by Highway's names in lower case: on
/// x86-64 avx3 (AVX-512 with BW, DQ, VL), avx3_int16 (the same with the decoder's inner layers in 16-bit fixed point
/// through AVX512_VNNI: nearly twice as fast, less exact, see decoder.h; taken only when asked for), avx3_amx
/// (all of the decoder's hidden layers in AMX tiles of bf16; likewise only when asked for, since it never ran on a
/// machine that has them), avx2 (with FMA),
/// sse4 and the portable code, scalar or emu128 by the compiler's version; on arm64 neon.
std::vector<std::string> available_isas();

/// What the decoder's inner layers are computed in; everything else is single precision everywhere.
enum class Arithmetic { kFp32, kInt16, kTiles };
/// Whether this machine and build have it, and which one is in use.
bool available(Arithmetic arithmetic) noexcept;
Arithmetic decoder_arithmetic() noexcept;

/// Name of the one in use.
std::string_view active_isa() noexcept;

/// Forces one (`--isa`); "auto" takes the best. The error lists what is available. Call before any thread uses a
/// kernel.
Status select_isa(std::string_view name);

}  // namespace gatefield::kernels
