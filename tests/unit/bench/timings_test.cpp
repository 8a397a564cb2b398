#include "tests/bench/timings.h"

#include <gtest/gtest.h>

namespace gatefield::bench {
namespace {

std::vector<double> microseconds_from_1_to(int count) {
  std::vector<double> values_s(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) values_s[static_cast<std::size_t>(i)] = 1e-6 * (count - i);  // in no good order
  return values_s;
}

TEST(Timings, ASecondIsAMillionMicroseconds) {
  const std::string line = line_us("wire", microseconds_from_1_to(2000));
  EXPECT_NE(line.find("wire "), std::string::npos);
  for (const char* figure : {"n   2000", "p50    1001 us", "p99    1980 us", "p99.9    1998 us", "max    2000 us"})
    EXPECT_NE(line.find(figure), std::string::npos) << figure << " in: " << line;
  EXPECT_NE(line_us("wire", {}).find("nothing arrived"), std::string::npos);
}

TEST(Timings, FieldsCarryTheirPrefix) {
  EXPECT_EQ(fields_us("beyond_", microseconds_from_1_to(1000)),
            ", \"beyond_p50_us\": 501.0, \"beyond_p99_us\": 990.0, \"beyond_p999_us\": 999.0");
  EXPECT_EQ(fields_us("", {}), "");
}

}  // namespace
}  // namespace gatefield::bench
