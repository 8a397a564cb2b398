#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "client/firmware/mavlink/messages.h"
#include "common/base/text.h"

namespace gatefield::mavlink {
namespace {

constexpr double kLargestFloat = std::numeric_limits<float>::max();

std::string expectation(const Allowed& allowed) {
  std::string sentence =
      allowed.most >= kLargestFloat ? "a finite number" : text(allowed.least) + " to " + text(allowed.most);
  if (!allowed.unit.empty()) sentence.append(" ").append(allowed.unit);
  if (allowed.kind == Allowed::Kind::kWithinOrUnknown) sentence += ", or NaN for not known";
  return sentence;
}

bool fits(double value, const Allowed& allowed) noexcept {
  if (std::isnan(value)) return allowed.kind == Allowed::Kind::kWithinOrUnknown;
  return value >= allowed.least && value <= allowed.most;
}

/// False for what is not finite, too.
bool has_unit_length(const std::array<float, 4>& q) noexcept {
  double squares = 0.0;
  for (const float number : q) squares += static_cast<double>(number) * static_cast<double>(number);
  return std::abs(std::sqrt(squares) - 1.0) <= kQuaternionTolerance;
}

Error not_a_quaternion(const std::string& name, const std::array<float, 4>& q) {
  std::string numbers;
  for (const float number : q) numbers += (numbers.empty() ? "(" : ", ") + text(static_cast<double>(number));
  return Error::invalid(name, numbers + ")", "a quaternion of length 1 (w, x, y, z)");
}

template <std::size_t kLength>
std::string_view up_to_nul(const std::array<char, kLength>& characters) noexcept {
  const auto* const end = std::find(characters.begin(), characters.end(), '\0');
  return {characters.data(), static_cast<std::size_t>(end - characters.begin())};
}

/// Names are put together for failures only, so that a good message costs no allocation.
template <typename Kind, typename Value>
Status check(const Field<Kind, Value>& field, const Value& value) {
  const auto name = [&field] { return std::string(Kind::kName).append(".").append(field.name); };
  const auto wrong_number = [&field](const std::string& which, double number) {
    return Error::invalid(which, text(number), expectation(field.allowed));
  };
  using Number = typename Element<Value>::Type;
  if (field.allowed.kind == Allowed::Kind::kAnything) return {};
  if constexpr (std::same_as<Value, std::array<float, 4>>) {
    if (field.allowed.kind == Allowed::Kind::kUnitQuaternion)
      return has_unit_length(value) ? Status() : not_a_quaternion(name(), value);
  }
  if constexpr (std::same_as<Number, char>) {
    const std::string_view words = up_to_nul(value);
    if (!gatefield::printable(words))
      return Error::invalid(name(), "\"" + shown(words, value.size()) + "\"", "printable characters");
  } else if constexpr (Element<Value>::kArray) {
    for (std::size_t i = 0; i < value.size(); ++i) {
      const auto number = static_cast<double>(value[i]);
      if (!fits(number, field.allowed)) return wrong_number(name() + "[" + text(i) + "]", number);
    }
  } else {
    const auto number = static_cast<double>(value);
    if (!fits(number, field.allowed)) return wrong_number(name(), number);
  }
  return {};
}

template <typename Kind>
Status check_all(const Kind& message) {
  Status status;
  for_each_field<Kind>([&]<typename Value>(const Field<Kind, Value>& field) {
    if (status.ok()) status = check(field, message.*field.member);
  });
  return status;
}

}  // namespace

Status validate(const Message& message) {
  Status status = std::visit([](const auto& content) { return check_all(content); }, message);
  const auto* const attitude = std::get_if<AttitudeQuaternion>(&message);
  if (!status.ok() || attitude == nullptr) return status;
  const std::array<float, 4> q{attitude->q1, attitude->q2, attitude->q3, attitude->q4};
  if (has_unit_length(q)) return {};
  return not_a_quaternion("ATTITUDE_QUATERNION.q1 to q4", q);
}

}  // namespace gatefield::mavlink
