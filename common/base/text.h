#pragma once

#include <Eigen/Core>
#include <concepts>
#include <string>
#include <string_view>

/// Values as they stand in sentences for people. Thread-safe: yes.   Real-time safe: no (strings).
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

/// False when it holds control characters, which could forge log lines and terminal commands.
bool printable(std::string_view text) noexcept;

}  // namespace gatefield
