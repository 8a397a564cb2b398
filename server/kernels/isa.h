#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"

namespace gatefield::kernels {

/// Instruction sets that this build has and this machine can run, best first, by Highway's names in lower case: on
/// x86-64 avx3 (AVX-512 with BW, DQ, VL), avx3_bf16 (the same with the decoder's inner layers in AVX512_BF16: nearly
/// twice as fast, but less exact than what "auto" may take, see decoder.h), avx2 (with FMA), sse4 and the portable
/// code, scalar or emu128 by the compiler's version.
std::vector<std::string> available_isas();

/// Whether this machine and build have avx3_bf16, and whether it is in use.
bool bf16_available() noexcept;
bool bf16_active() noexcept;

/// Name of the one in use.
std::string_view active_isa() noexcept;

/// Forces one (`--isa`); "auto" takes the best. The error lists what is available. Call before any thread uses a
/// kernel.
Status select_isa(std::string_view name);

}  // namespace gatefield::kernels
