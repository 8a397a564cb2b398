#include "tests/support/mavlink_words.h"

#include <array>
#include <bit>
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
