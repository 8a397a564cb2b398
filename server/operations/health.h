#pragma once

#include <string>

#include "common/base/clock.h"
#include "server/service/figures.h"

namespace gatefield::operations {

/// Whether a server does its work. One that doesn't is better started again.
struct Health {
  bool well = true;
  std::string words;  ///< a sentence: what is wrong, or how much it flies
};

/// Housekeeping makes figures twice a second, and a step takes milliseconds: when either takes longer than this, a
/// thread hangs. A machine that is merely too busy is behind by less.
inline constexpr Stamp kHangsAfter = std::chrono::seconds(5);

/// @param now  of the service's clock
Health health_of(const service::Figures& figures, Stamp now);

}  // namespace gatefield::operations
