#include "server/kernels/isa.h"

#include <hwy/highway.h>

#include <algorithm>
#include <cctype>
#include <cstdint>

#if GATEFIELD_AVX512_INT16 || GATEFIELD_AMX_BF16
#include <cpuid.h>
#endif
#if GATEFIELD_AMX_BF16
#include <sys/syscall.h>
#include <unistd.h>
#endif

namespace gatefield::kernels {
namespace {

struct Isa {
  std::int64_t target;
  std::string name;
  Arithmetic arithmetic = Arithmetic::kFp32;
};

Arithmetic in_use = Arithmetic::kFp32;  // set before threads start

/// CPUID leaf 7.0: AVX512_VNNI. That the system keeps the registers is known from Highway's choice of AVX-512.
bool cpu_has_int16() noexcept {
#if GATEFIELD_AVX512_INT16
  unsigned a = 0, b = 0, c = 0, d = 0;
  return __get_cpuid_count(7, 0, &a, &b, &c, &d) != 0 && (c >> 11 & 1) != 0;
#else
  return false;
#endif
}

/// CPUID leaf 7.0: AMX-TILE and AMX-BF16; XCR0: the system keeps configuration and data of tiles; and Linux has to be
/// asked for the latter, once per process, before threads start.
bool amx_granted() noexcept {
#if GATEFIELD_AMX_BF16
  unsigned a = 0, b = 0, c = 0, d = 0;
  if (__get_cpuid_count(7, 0, &a, &b, &c, &d) == 0 || (d >> 24 & 1) == 0 || (d >> 22 & 1) == 0) return false;
  if (__get_cpuid(1, &a, &b, &c, &d) == 0 || (c >> 27 & 1) == 0) return false;
  std::uint32_t low = 0, high = 0;
  asm("xgetbv" : "=a"(low), "=d"(high) : "c"(0));
  if ((low >> 17 & 3) != 3) return false;
  constexpr long kRequestPermission = 0x1023, kTileData = 18;  // ARCH_REQ_XCOMP_PERM, XFEATURE_XTILEDATA
  return syscall(SYS_arch_prctl, kRequestPermission, kTileData) == 0;
#else
  return false;
#endif
}

/// What this machine has, asked once before anything could have been forced. Lower bits are better, in Highway's own
/// order.
const std::vector<Isa>& machine_isas() {
  static const std::vector<Isa> isas = [] {
    std::vector<Isa> found;
    for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
      std::string name = hwy::TargetName(target);
      std::transform(name.begin(), name.end(), name.begin(), [](unsigned char c) { return std::tolower(c); });
      found.push_back({target, name});
      if (target == HWY_AVX3 && cpu_has_int16()) found.push_back({target, name + "_int16", Arithmetic::kInt16});
      if (target == HWY_AVX3 && amx_granted()) found.push_back({target, name + "_amx", Arithmetic::kTiles});
    }
    return found;
  }();
  return isas;
}

void apply(std::int64_t targets, Arithmetic arithmetic) {
  in_use = arithmetic;
  hwy::SetSupportedTargetsForTest(targets);
  // Fill the dispatch index here, so that the first control step doesn't ask CPUID.
  hwy::GetChosenTarget().Update(hwy::SupportedTargets());
}

}  // namespace

std::vector<std::string> available_isas() {
  std::vector<std::string> names;
  for (const Isa& isa : machine_isas()) names.push_back(isa.name);
  return names;
}

bool available(Arithmetic arithmetic) noexcept {
  const std::vector<Isa>& isas = machine_isas();
  return std::any_of(isas.begin(), isas.end(), [&](const Isa& isa) { return isa.arithmetic == arithmetic; });
}
Arithmetic decoder_arithmetic() noexcept { return in_use; }

std::string_view active_isa() noexcept {
  const std::vector<Isa>& isas = machine_isas();
  const std::int64_t targets = hwy::SupportedTargets();
  for (const Isa& isa : isas) {
    if ((targets & isa.target) && isa.arithmetic == in_use) return isa.name;
  }
  return isas.back().name;
}

Status select_isa(std::string_view name) {
  const std::vector<Isa>& isas = machine_isas();
  if (name == "auto") {
    apply(0, Arithmetic::kFp32);
    return {};
  }
  std::string list;
  for (const Isa& isa : isas) {
    if (isa.name == name) {
      apply(isa.target, isa.arithmetic);
      return {};
    }
    list += ", " + isa.name;
  }
  return Error{"instruction set '" + std::string(name) + "' is not available here, expected one of: auto" + list};
}

}  // namespace gatefield::kernels
