#include "common/base/text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace gatefield {
namespace {

bool is_control(char c) noexcept {
  const auto byte = static_cast<unsigned char>(c);
  return byte < 0x20 || byte == 0x7f;
}

}  // namespace

std::string text(double value) { return fmt::format("{:.9g}", value); }

std::string brief(double value) { return fmt::format("{:g}", value); }

std::string fixed(double value, int digits) { return fmt::format("{:.{}f}", value, digits); }

std::string clock_text(double seconds) {
  constexpr double kMax_s = 1e15;  // any number is some text
  const auto total = static_cast<long long>(std::clamp(std::isfinite(seconds) ? seconds : 0.0, 0.0, kMax_s) + 0.5);
  if (total < 3600) return fmt::format("{}:{:02}", total / 60, total % 60);
  return fmt::format("{}:{:02}:{:02}", total / 3600, total / 60 % 60, total % 60);
}

std::string hex(std::uint64_t value) { return fmt::format("{:016x}", value); }

std::string shown(std::string_view text, std::size_t longest) {
  std::string out(text.substr(0, longest));
  std::replace_if(out.begin(), out.end(), is_control, '?');
  return out;
}

bool printable(std::string_view text) noexcept { return std::none_of(text.begin(), text.end(), is_control); }

}  // namespace gatefield
