#pragma once

#include <cstdio>
#include <string>
#include <vector>

#include "common/base/statistics.h"

/// What many times come to. Shared by the benchmarks.
namespace gatefield::bench {

/// A line for people. @param values_s  seconds, said in microseconds
inline std::string line_us(const std::string& what, const std::vector<double>& values_s) {
  char text[200];
  if (values_s.empty()) {
    std::snprintf(text, sizeof text, "%-52s nothing arrived", what.c_str());
  } else {
    std::snprintf(text, sizeof text, "%-52s n %6zu   p50 %7.0f us   p99 %7.0f us   p99.9 %7.0f us   max %7.0f us",
                  what.c_str(), values_s.size(), 1e6 * quantile(values_s, 0.5), 1e6 * quantile(values_s, 0.99),
                  1e6 * quantile(values_s, 0.999), 1e6 * quantile(values_s, 1.0));
  }
  return text;
}

/// The same as fields of a JSON object: "<prefix>p50_us": ..., p99 and p999. Nothing when there is no value.
inline std::string fields_us(const std::string& prefix, const std::vector<double>& values_s) {
  if (values_s.empty()) return {};
  char text[200];
  std::snprintf(text, sizeof text, R"(, "%sp50_us": %.1f, "%sp99_us": %.1f, "%sp999_us": %.1f)", prefix.c_str(),
                1e6 * quantile(values_s, 0.5), prefix.c_str(), 1e6 * quantile(values_s, 0.99), prefix.c_str(),
                1e6 * quantile(values_s, 0.999));
  return text;
}

}  // namespace gatefield::bench
