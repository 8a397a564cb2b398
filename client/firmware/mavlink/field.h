#pragma once

#include <array>
#include <bit>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <string_view>
#include <tuple>
#include <type_traits>

#include "client/firmware/mavlink/checksum.h"

/// What a message of MAVLink 2 consists of. Each message is a struct with `kId`, `kName` and `fields()`, the one table
/// of its fields in the order of the wire: packing, unpacking, lengths, the checksum's extra byte, checks and the
/// sentences about them follow from it.
///
/// The order of the wire (mavlink.io, "MAVLink serialization"): fields by falling size of their elements, those of one
/// size as the definition lists them; extension fields follow as the definition lists them. Numbers are little endian.
/// Thread-safe: yes (pure).   Real-time safe: yes.
namespace gatefield::firmware::mavlink {

static_assert(std::endian::native == std::endian::little, "packing copies numbers as the machine holds them");

/// What a field's value may be.
struct Allowed {
  enum class Kind : std::uint8_t {
    kAnything,
    kWithin,           ///< finite, from least to most, both included
    kWithinOrUnknown,  ///< the same, or NaN: not known
    kUnitQuaternion,   ///< the array's length is 1 to kQuaternionTolerance
    kPrintable,        ///< characters up to the first NUL are printable ASCII
  };
  Kind kind = Kind::kAnything;
  double least = 0.0;
  double most = 0.0;
  std::string_view unit;
};
inline constexpr double kQuaternionTolerance = 0.01;

constexpr Allowed within(double least, double most, std::string_view unit = {}) noexcept {
  return {Allowed::Kind::kWithin, least, most, unit};
}
constexpr Allowed around_zero(double most, std::string_view unit = {}) noexcept { return within(-most, most, unit); }
constexpr Allowed or_unknown(Allowed allowed) noexcept {
  allowed.kind = Allowed::Kind::kWithinOrUnknown;
  return allowed;
}
constexpr Allowed unit_quaternion() noexcept { return {Allowed::Kind::kUnitQuaternion, 0.0, 0.0, {}}; }
constexpr Allowed printable() noexcept { return {Allowed::Kind::kPrintable, 0.0, 0.0, {}}; }

template <typename Message, typename Value>
struct Field {
  std::string_view name;
  Value Message::*member;
  Allowed allowed;
  bool extension;  ///< not in MAVLink 1, not in the checksum's extra byte, 0 when the sender knows none
};

template <typename Message, typename Value>
constexpr Field<Message, Value> field(std::string_view name, Value Message::*member, Allowed allowed = {}) noexcept {
  return {name, member, allowed, false};
}
template <typename Message, typename Value>
constexpr Field<Message, Value> extension(std::string_view name, Value Message::*member,
                                          Allowed allowed = {}) noexcept {
  return {name, member, allowed, true};
}

/// One number or character, or an array of them.
template <typename Value>
struct Element {
  using Type = Value;
  static constexpr std::size_t kCount = 1;
  static constexpr bool kArray = false;
};
template <typename Value, std::size_t kLength>
struct Element<std::array<Value, kLength>> {
  using Type = Value;
  static constexpr std::size_t kCount = kLength;
  static constexpr bool kArray = true;
};

template <typename Value>
consteval std::string_view type_name() {
  if constexpr (std::same_as<Value, char>) return "char";
  if constexpr (std::same_as<Value, float>) return "float";
  if constexpr (std::same_as<Value, double>) return "double";
  if constexpr (std::same_as<Value, std::uint8_t>) return "uint8_t";
  if constexpr (std::same_as<Value, std::int8_t>) return "int8_t";
  if constexpr (std::same_as<Value, std::uint16_t>) return "uint16_t";
  if constexpr (std::same_as<Value, std::int16_t>) return "int16_t";
  if constexpr (std::same_as<Value, std::uint32_t>) return "uint32_t";
  if constexpr (std::same_as<Value, std::int32_t>) return "int32_t";
  if constexpr (std::same_as<Value, std::uint64_t>) return "uint64_t";
  if constexpr (std::same_as<Value, std::int64_t>) return "int64_t";
}

/// Calls visitor(field) for each field of the table.
template <typename Message, typename Visitor>
constexpr void for_each_field(Visitor&& visitor) {
  std::apply([&](const auto&... fields) { (visitor(fields), ...); }, Message::fields());
}

/// Bytes of the whole payload, extensions included.
template <typename Message>
consteval std::size_t payload_length() {
  std::size_t length = 0;
  for_each_field<Message>([&]<typename Value>(const Field<Message, Value>&) { length += sizeof(Value); });
  return length;
}

/// Bytes of the payload without extensions: what a frame of MAVLink 1 has.
template <typename Message>
consteval std::size_t base_length() {
  std::size_t length = 0;
  for_each_field<Message>([&]<typename Value>(const Field<Message, Value>& field) {
    if (!field.extension) length += sizeof(Value);
  });
  return length;
}

/// The byte that goes into the checksum after the payload, so that sender and receiver notice when their definitions
/// differ: the checksum over "NAME ", then for each field that is no extension "type name " and, of an array, its
/// length as one byte; low and high byte of that combined by XOR.
template <typename Message>
consteval std::uint8_t crc_extra() {
  Checksum checksum;
  checksum.add(Message::kName);
  checksum.add(" ");
  for_each_field<Message>([&]<typename Value>(const Field<Message, Value>& field) {
    if (field.extension) return;
    checksum.add(type_name<typename Element<Value>::Type>());
    checksum.add(" ");
    checksum.add(field.name);
    checksum.add(" ");
    if (Element<Value>::kArray) checksum.add(static_cast<std::uint8_t>(Element<Value>::kCount));
  });
  return static_cast<std::uint8_t>((checksum.value() & 0xFF) ^ (checksum.value() >> 8));
}

/// True when the table is in the order of the wire and fits a frame.
template <typename Message>
consteval bool in_wire_order() {
  bool right = true;
  bool extensions = false;
  std::size_t size = sizeof(double);
  for_each_field<Message>([&]<typename Value>(const Field<Message, Value>& field) {
    if (field.extension) {
      extensions = true;
      return;
    }
    constexpr std::size_t kSize = sizeof(typename Element<Value>::Type);
    if (extensions || kSize > size) right = false;
    size = kSize;
  });
  return right && payload_length<Message>() <= 255;
}

}  // namespace gatefield::firmware::mavlink
