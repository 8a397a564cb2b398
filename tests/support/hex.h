#pragma once

#include <cctype>
#include <charconv>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace gatefield::test {

/// Bytes of their hexadecimal digits, with white space anywhere between two bytes. Empty: something else, or half a
/// byte.
inline std::optional<std::vector<std::uint8_t>> bytes_of_hex(std::string_view text) {
  std::vector<std::uint8_t> bytes;
  for (std::size_t at = 0; at < text.size();) {
    if (std::isspace(static_cast<unsigned char>(text[at]))) {
      ++at;
      continue;
    }
    const std::string_view digits = text.substr(at, 2);
    std::uint8_t byte = 0;
    const auto read = std::from_chars(digits.data(), digits.data() + digits.size(), byte, 16);
    if (digits.size() < 2 || read.ptr != digits.data() + 2) return std::nullopt;
    bytes.push_back(byte);
    at += 2;
  }
  return bytes;
}

}  // namespace gatefield::test
