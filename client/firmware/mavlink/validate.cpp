#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "client/firmware/mavlink/messages.h"
#include "common/base/text.h"

namespace gatefield::firmware::mavlink {
namespace {

constexpr double kLargestFloat = std::numeric_limits<float>::max();

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

template <std::size_t kLength>
bool is_printable(const std::array<char, kLength>& characters) noexcept {
  const auto* const end = std::find(characters.begin(), characters.end(), '\0');
  return gatefield::printable({characters.data(), static_cast<std::size_t>(end - characters.begin())});
}

template <typename Kind, typename Value>
std::optional<Fault> fault_of(const Field<Kind, Value>& field, const Value& value) noexcept {
  const Allowed& allowed = field.allowed;
  Fault fault{Kind::kName, field.name, -1, 0.0, {}, allowed};
  if (allowed.kind == Allowed::Kind::kAnything) return std::nullopt;
  if constexpr (std::same_as<Value, std::array<float, 4>>) {
    if (allowed.kind == Allowed::Kind::kUnitQuaternion) {
      fault.quaternion = value;
      return has_unit_length(value) ? std::nullopt : std::optional(fault);
    }
  }
  if constexpr (std::same_as<typename Element<Value>::Type, char>) {
    return is_printable(value) ? std::nullopt : std::optional(fault);
  } else if constexpr (Element<Value>::kArray) {
    for (std::size_t i = 0; i < value.size(); ++i) {
      fault.index = static_cast<int>(i);
      fault.value = static_cast<double>(value[i]);
      if (!fits(fault.value, allowed)) return fault;
    }
    return std::nullopt;
  } else {
    fault.value = static_cast<double>(value);
    return fits(fault.value, allowed) ? std::nullopt : std::optional(fault);
  }
}

template <typename Kind>
std::optional<Fault> first_fault(const Kind& message) noexcept {
  std::optional<Fault> fault;
  for_each_field<Kind>([&]<typename Value>(const Field<Kind, Value>& field) {
    if (!fault) fault = fault_of(field, message.*field.member);
  });
  return fault;
}

std::string expectation(const Allowed& allowed) {
  std::string sentence =
      allowed.most >= kLargestFloat ? "a finite number" : text(allowed.least) + " to " + text(allowed.most);
  if (!allowed.unit.empty()) sentence.append(" ").append(allowed.unit);
  if (allowed.kind == Allowed::Kind::kWithinOrUnknown) sentence += ", or NaN for not known";
  return sentence;
}

}  // namespace

std::optional<Fault> find_fault(const Message& message) noexcept {
  const auto fault = std::visit([](const auto& content) { return first_fault(content); }, message);
  const auto* const attitude = std::get_if<AttitudeQuaternion>(&message);
  if (fault || attitude == nullptr) return fault;
  const std::array<float, 4> q{attitude->q1, attitude->q2, attitude->q3, attitude->q4};
  if (has_unit_length(q)) return std::nullopt;
  return Fault{AttitudeQuaternion::kName, "q1 to q4", -1, 0.0, q, unit_quaternion()};
}

Error describe(const Fault& fault) {
  std::string name = std::string(fault.message) + "." + std::string(fault.field);
  if (fault.index >= 0) name += "[" + text(fault.index) + "]";
  switch (fault.allowed.kind) {
    case Allowed::Kind::kUnitQuaternion: {
      std::string numbers;
      for (const float number : fault.quaternion)
        numbers += (numbers.empty() ? "(" : ", ") + text(static_cast<double>(number));
      return Error::invalid(name, numbers + ")", "a quaternion of length 1 (w, x, y, z)");
    }
    case Allowed::Kind::kPrintable:
      return Error::invalid(name, "a text with control characters", "printable characters");
    default:
      return Error::invalid(name, text(fault.value), expectation(fault.allowed));
  }
}

Status validate(const Message& message) {
  const auto fault = find_fault(message);
  return fault ? Status(describe(*fault)) : Status();
}

}  // namespace gatefield::firmware::mavlink
