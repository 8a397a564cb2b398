#pragma once

#include <gtest/gtest.h>

#include <cctype>
#include <cstdint>
#include <fstream>
#include <string>
#include <vector>

namespace gatefield::test {

/// The bytes of tests/data/wire/<name>.hex. A file that is missing, or ends in half a byte, fails the test.
inline std::vector<std::uint8_t> wire_bytes(const std::string& name) {
  std::ifstream file(std::string(GATEFIELD_SOURCE_DIR) + "/tests/data/wire/" + name + ".hex");
  EXPECT_TRUE(file.good()) << name;
  std::vector<std::uint8_t> bytes;
  std::string digits;
  for (char c = 0; file.get(c);) {
    if (std::isspace(static_cast<unsigned char>(c))) continue;
    digits.push_back(c);
    if (digits.size() < 2) continue;
    bytes.push_back(static_cast<std::uint8_t>(std::stoi(digits, nullptr, 16)));
    digits.clear();
  }
  EXPECT_TRUE(digits.empty()) << name;
  return bytes;
}

}  // namespace gatefield::test
