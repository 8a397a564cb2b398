#include "tests/support/mavlink_words.h"

#include <array>
#include <bit>
#include <limits>
#include <utility>

namespace gatefield::test {
namespace {

constexpr std::string_view kDigits = "0123456789abcdef";

template <typename Number>
std::string word(Number number) {
  if constexpr (std::same_as<Number, float>) {
    const auto bits = std::bit_cast<std::uint32_t>(number);
    std::string digits;
    for (int shift = 28; shift >= 0; shift -= 4) digits += kDigits[(bits >> shift) & 0xF];
    return digits;
  } else {
    return std::to_string(number);
  }
}

template <typename Value>
std::string words(const Value& value) {
  using Number = typename mavlink::Element<Value>::Type;
  std::string out;
  if constexpr (std::same_as<Number, char>) {
    for (const char c : value) {
      if (c == '\0') break;
      out += c;
    }
  } else if constexpr (mavlink::Element<Value>::kArray) {
    for (const Number number : value) out += (out.empty() ? "" : ",") + word(number);
  } else {
    out = word(value);
  }
  return out;
}

template <typename Number>
void draw(Number* number, Random* random) {
  if constexpr (std::same_as<Number, float>) {
    *number = static_cast<float>(random->uniform(-2000.0, 2000.0));
  } else if constexpr (std::same_as<Number, char>) {
    *number = static_cast<char>('a' + random->bits() % 26);
  } else {
    *number = static_cast<Number>(std::uint64_t{random->bits()} << 32 | random->bits());
  }
}

/// Calls visit(field, number, message, name) for each number of each message, the number being the message's own: what
/// it is set to is in the message; afterwards it is as it was.
template <typename Visit>
void for_each_number(Visit&& visit) {
  for (std::size_t kind = 0; kind < mavlink::definitions().size(); ++kind) {
    mavlink::Message message = empty_message(kind);
    std::visit(
        [&]<typename Kind>(Kind& content) {
          mavlink::for_each_field<Kind>([&]<typename Value>(const mavlink::Field<Kind, Value>& field) {
            using Number = typename mavlink::Element<Value>::Type;
            if constexpr (!std::same_as<Number, char>) {
              for (std::size_t i = 0; i < mavlink::Element<Value>::kCount; ++i) {
                Number* number = nullptr;
                if constexpr (mavlink::Element<Value>::kArray)
                  number = &(content.*field.member)[i];
                else
                  number = &(content.*field.member);
                const Number before = *number;
                visit(field.allowed, number, message, std::string(Kind::kName) + "." + std::string(field.name));
                *number = before;
              }
            }
          });
        },
        message);
  }
}

/// What a checked number must not be.
template <typename Number>
std::vector<Number> faults_of(const mavlink::Allowed& allowed) {
  using Limits = std::numeric_limits<Number>;
  std::vector<Number> faults;
  if constexpr (std::same_as<Number, float>) {
    faults = {Limits::infinity(), -Limits::infinity()};
    if (allowed.kind != mavlink::Allowed::Kind::kWithinOrUnknown) faults.push_back(Limits::quiet_NaN());
    if (allowed.kind == mavlink::Allowed::Kind::kUnitQuaternion) {
      faults.push_back(1.2F);
    } else if (allowed.most < static_cast<double>(Limits::max())) {
      const double beyond = 1e-3 * (allowed.most - allowed.least);
      faults.push_back(static_cast<float>(allowed.most + beyond));
      faults.push_back(static_cast<float>(allowed.least - beyond));
    }
  } else {
    if (allowed.most < static_cast<double>(Limits::max())) faults.push_back(static_cast<Number>(allowed.most + 1));
    if (allowed.least > static_cast<double>(Limits::min())) faults.push_back(static_cast<Number>(allowed.least - 1));
  }
  return faults;
}

template <std::size_t... kIndex>
mavlink::Message alternative(std::size_t kind, std::index_sequence<kIndex...>) {
  mavlink::Message message;
  (void)((kIndex == kind && (message.emplace<kIndex>(), true)) || ...);
  return message;
}

}  // namespace

std::string words_of(const mavlink::Message& message) {
  return std::visit(
      []<typename Kind>(const Kind& content) {
        std::string out(Kind::kName);
        mavlink::for_each_field<Kind>([&](const auto& field) {
          out.append(" ").append(field.name).append("=").append(words(content.*field.member));
        });
        return out;
      },
      message);
}

mavlink::Message empty_message(std::size_t kind) {
  return alternative(kind, std::make_index_sequence<std::variant_size_v<mavlink::Message>>());
}

mavlink::Message drawn_message(std::size_t kind, Random* random) {
  mavlink::Message message = empty_message(kind);
  std::visit(
      [random]<typename Kind>(Kind& content) {
        mavlink::for_each_field<Kind>([&]<typename Value>(const mavlink::Field<Kind, Value>& field) {
          Value& value = content.*field.member;
          if constexpr (mavlink::Element<Value>::kArray) {
            for (auto& element : value) draw(&element, random);
          } else {
            draw(&value, random);
          }
        });
      },
      message);
  return message;
}

void for_each_faulty_message(const std::function<void(const std::string&, const mavlink::Message&)>& use) {
  for_each_number([&]<typename Number>(const mavlink::Allowed& allowed, Number* number, const mavlink::Message& message,
                                       const std::string& name) {
    if (allowed.kind == mavlink::Allowed::Kind::kAnything) return;
    for (const Number fault : faults_of<Number>(allowed)) {
      *number = fault;
      use(name, message);
    }
  });
}

void for_each_extreme_message(const std::function<void(const std::string&, const mavlink::Message&)>& use) {
  for_each_number([&]<typename Number>(const mavlink::Allowed&, Number* number, const mavlink::Message& message,
                                       const std::string& name) {
    using Limits = std::numeric_limits<Number>;
    if constexpr (sizeof(Number) == 1) {
      for (int value = int{Limits::min()}; value <= int{Limits::max()}; ++value) {
        *number = static_cast<Number>(value);
        use(name, message);
      }
    } else if constexpr (!std::same_as<Number, float>) {
      for (const Number value : {Limits::min(), Limits::max()}) {
        *number = value;
        use(name, message);
      }
    }
  });
}

std::string hex(std::span<const std::uint8_t> bytes) {
  std::string digits;
  for (const std::uint8_t byte : bytes) {
    digits += kDigits[byte >> 4];
    digits += kDigits[byte & 0xF];
  }
  return digits;
}

std::vector<std::uint8_t> unhex(std::string_view digits) {
  std::vector<std::uint8_t> bytes;
  for (std::size_t i = 0; i + 1 < digits.size(); i += 2)
    bytes.push_back(static_cast<std::uint8_t>(kDigits.find(digits[i]) << 4 | kDigits.find(digits[i + 1])));
  return bytes;
}

}  // namespace gatefield::test
