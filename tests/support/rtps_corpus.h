#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "tests/support/hex.h"

namespace gatefield::test {

/// The packets of a file that tests/data/rtps/record.py wrote. Fewer than were written, when it is not whole.
inline std::vector<std::vector<std::uint8_t>> recorded_packets(const std::filesystem::path& file) {
  std::vector<std::vector<std::uint8_t>> packets;
  std::ifstream in(file);
  std::string digits;
  for (std::string line; std::getline(in, line);) {
    if (line.starts_with('#')) continue;
    digits += line;
    if (!line.empty() || digits.empty()) continue;
    if (auto bytes = bytes_of_hex(digits)) packets.push_back(std::move(*bytes));
    digits.clear();
  }
  return packets;
}

}  // namespace gatefield::test
