#pragma once

#include <cstdint>
#include <span>
#include <string_view>

namespace gatefield::firmware::mavlink {

/// The checksum of MAVLink frames: CRC-16/MCRF4XX (polynomial 0x1021, bits reflected, begun with 0xFFFF, no final
/// inversion; its check value over "123456789" is 0x6F91).
/// Thread-safe: as a value.   Real-time safe: yes.
class Checksum {
 public:
  constexpr void add(std::uint8_t byte) noexcept {
    std::uint8_t low = static_cast<std::uint8_t>(byte ^ (value_ & 0xFFu));
    low = static_cast<std::uint8_t>(low ^ (low << 4));
    value_ = static_cast<std::uint16_t>((value_ >> 8) ^ (low << 8) ^ (low << 3) ^ (low >> 4));
  }
  constexpr void add(std::span<const std::uint8_t> bytes) noexcept {
    for (const std::uint8_t byte : bytes) add(byte);
  }
  constexpr void add(std::string_view characters) noexcept {
    for (const char c : characters) add(static_cast<std::uint8_t>(c));
  }
  constexpr std::uint16_t value() const noexcept { return value_; }

 private:
  std::uint16_t value_ = 0xFFFF;
};

}  // namespace gatefield::firmware::mavlink
