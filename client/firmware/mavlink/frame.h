#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "client/firmware/mavlink/messages.h"

/// Frames of MAVLink (mavlink.io, "MAVLink packet format"), as bytes:
///   version 2  0xFD length incompatible compatible sequence system component id(3) payload checksum(2) [signature(13)]
///   version 1  0xFE length sequence system component id payload checksum(2)
/// The checksum covers everything from the length to the payload, and then the definition's extra byte. Version 2
/// leaves out the zeros at the payload's end, all but the first byte; version 1 has no extension fields.
namespace gatefield::firmware::mavlink {

inline constexpr std::size_t kLongestPayload = 255;
inline constexpr std::size_t kLongestFrame = 280;  ///< version 2, with a signature

/// Who speaks. Systems are vehicles and ground stations, 1 to 255; components are their parts.
struct Address {
  std::uint8_t system = 0;
  std::uint8_t component = 0;
  bool operator==(const Address&) const = default;
};
inline constexpr std::uint8_t kAutopilotComponent = 1;
inline constexpr std::uint8_t kOnboardComputerComponent = 191;

/// A frame as it came, its checksum right.
struct Frame {
  std::uint8_t version = 2;
  std::uint8_t sequence = 0;
  Address from;
  std::uint32_t id = 0;
  bool is_signed = false;                               ///< there was a signature, which nobody has checked
  std::array<std::uint8_t, kLongestPayload> payload{};  ///< zeros behind what came
};

/// A frame to be sent.
class Packet {
 public:
  std::span<const std::uint8_t> bytes() const noexcept { return {bytes_.data(), size_}; }

 private:
  friend Packet pack(const Message& message, Address from, std::uint8_t sequence, std::uint8_t version) noexcept;
  std::array<std::uint8_t, kLongestFrame> bytes_{};
  std::size_t size_ = 0;
};

/// The message as a frame. What validate() would refuse is packed all the same: whoever sends checks.
/// @param version  1 or 2
/// Thread-safe: yes (pure).   Real-time safe: yes.
Packet pack(const Message& message, Address from, std::uint8_t sequence, std::uint8_t version = 2) noexcept;

/// The message in a frame; empty: none with that id is known. The values are as they came: validate() checks them.
/// Thread-safe: yes (pure).   Real-time safe: yes.
std::optional<Message> unpack(const Frame& frame) noexcept;

}  // namespace gatefield::firmware::mavlink
