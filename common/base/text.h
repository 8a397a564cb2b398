#pragma once

#include <Eigen/Core>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

/// Values as they stand in sentences, tables and files. Thread-safe: yes.   Real-time safe: no (strings).
namespace gatefield {

/// The shortest form with at most nine digits: 0.5, 1e-05, nan.
std::string text(double value);
std::string text(std::integral auto value) { return std::to_string(value); }

/// "(1, 2.5, -3)"
template <typename Vector>
std::string text(const Eigen::MatrixBase<Vector>& v) {
  std::string out = "(";
  for (Eigen::Index i = 0; i < v.size(); ++i) out += (i ? ", " : "") + text(static_cast<double>(v[i]));
  return out + ")";
}

/// The shortest form with at most six digits, for people: 7, 0.333333, 1e-05.
std::string brief(double value);
/// So many digits after the point: fixed(2.5, 2) is "2.50".
std::string fixed(double value, int digits);
/// A time for people, in minutes or hours: 75 s is "1:15", 3700 s is "1:01:40"; what is not finite or below 0 is
/// "0:00".
std::string clock_text(double seconds);
/// 16 digits to the base of 16.
std::string hex(std::uint64_t value);

/// The text without what could do harm where it is shown or doesn't fit: control characters as "?", at most `longest`
/// bytes of it.
std::string shown(std::string_view text, std::size_t longest);
/// False when it holds control characters, which could forge log lines and terminal commands.
bool printable(std::string_view text) noexcept;

}  // namespace gatefield
