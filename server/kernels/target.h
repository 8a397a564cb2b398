#pragma once

#include <hwy/highway.h>

#include <cstddef>
#include <cstdint>

/// Highway's HWY_DYNAMIC_DISPATCH takes the best target of the machine, one for the whole process. A back end stands
/// for one target, so it picks that target's function from the table that HWY_EXPORT makes.
namespace gatefield::kernels {

/// Place of a target's entry in that table: 1 to HWY_MAX_DYNAMIC_TARGETS by its bit, then portable code (entry 0 would
/// choose by itself). Where only one target was compiled the table has one entry.
inline std::size_t table_index(std::int64_t target) noexcept {
  constexpr bool kOnlyOne = (HWY_TARGETS & (HWY_TARGETS - 1)) == 0;
  if (kOnlyOne) return 0;
  return hwy::Num0BitsBelowLS1Bit_Nonzero64(
      static_cast<std::uint64_t>(HWY_CHOSEN_TARGET_SHIFT(target) | HWY_CHOSEN_TARGET_MASK_SCALAR));
}

}  // namespace gatefield::kernels

/// What HWY_EXPORT(FUNCTION) has for one of HWY_TARGETS.
#define GATEFIELD_OF_TARGET(FUNCTION, target) (HWY_DISPATCH_TABLE(FUNCTION)[::gatefield::kernels::table_index(target)])
