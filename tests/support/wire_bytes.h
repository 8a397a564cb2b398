#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "tests/support/hex.h"

namespace gatefield::test {

/// The bytes of tests/data/wire/<name>.hex. A file that is missing, or ends in half a byte, fails the test.
inline std::vector<std::uint8_t> wire_bytes(const std::string& name) {
  std::ifstream file(std::string(GATEFIELD_SOURCE_DIR) + "/tests/data/wire/" + name + ".hex");
  EXPECT_TRUE(file.good()) << name;
  const auto bytes = bytes_of_hex(std::string(std::istreambuf_iterator<char>(file), {}));
  EXPECT_TRUE(bytes) << name;
  return bytes.value_or(std::vector<std::uint8_t>());
}

}  // namespace gatefield::test
