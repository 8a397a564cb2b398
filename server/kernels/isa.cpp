#include "server/kernels/isa.h"

#include <hwy/highway.h>

#include <algorithm>
#include <cctype>
#include <cstdint>

namespace gatefield::kernels {
namespace {

struct Isa {
  std::int64_t target;
  std::string name;
};

/// What this machine has, asked once before anything could have been forced. Lower bits are better, in Highway's own
/// order.
const std::vector<Isa>& machine_isas() {
  static const std::vector<Isa> isas = [] {
    std::vector<Isa> found;
    for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
      std::string name = hwy::TargetName(target);
      std::transform(name.begin(), name.end(), name.begin(), [](unsigned char c) { return std::tolower(c); });
      found.push_back({target, std::move(name)});
    }
    return found;
  }();
  return isas;
}

void apply(std::int64_t targets) {
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

std::string_view active_isa() noexcept {
  const std::vector<Isa>& isas = machine_isas();
  const std::int64_t targets = hwy::SupportedTargets();
  for (const Isa& isa : isas) {
    if (targets & isa.target) return isa.name;
  }
  return isas.back().name;
}

Status select_isa(std::string_view name) {
  const std::vector<Isa>& isas = machine_isas();
  if (name == "auto") {
    apply(0);
    return {};
  }
  std::string list;
  for (const Isa& isa : isas) {
    if (isa.name == name) {
      apply(isa.target);
      return {};
    }
    list += ", " + isa.name;
  }
  return Error{"instruction set '" + std::string(name) + "' is not available here, expected one of: auto" + list};
}

}  // namespace gatefield::kernels
