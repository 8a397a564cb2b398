#pragma once

#include <array>
#include <cstddef>
#include <string_view>

#include "common/base/result.h"

namespace gatefield {

inline constexpr std::size_t kErrorCodes = 15;

/// Where a code stands in arrays of kErrorCodes; numbers that this version doesn't know count as kOther.
constexpr std::size_t index(ErrorCode code) noexcept {
  const auto number = static_cast<std::size_t>(code);
  return number < kErrorCodes ? number : 0;
}

/// For machines: "not_rising".
constexpr std::string_view name(ErrorCode code) noexcept {
  constexpr std::array<std::string_view, kErrorCodes> kNames{
      "other",       "invalid",       "unknown_name", "unreadable", "version",
      "unsupported", "busy_name",     "busy_server",  "no_answer",  "leaving",
      "abandoned",   "wrong_session", "not_rising",   "frame",      "not_answering"};
  return kNames[index(code)];
}

}  // namespace gatefield
