#include "common/base/text.h"

#include <fmt/format.h>

#include <algorithm>

namespace gatefield {

std::string text(double value) { return fmt::format("{:.9g}", value); }

bool printable(std::string_view text) noexcept {
  return std::none_of(text.begin(), text.end(), [](char c) {
    const auto byte = static_cast<unsigned char>(c);
    return byte < 0x20 || byte == 0x7f;
  });
}

}  // namespace gatefield
