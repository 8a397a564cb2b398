#pragma once

#include <cstdint>
#include <span>

#include "common/dds/packet_fields.h"

/// What participants say of themselves, as packets have it. Inside common/dds only.
namespace gatefield::dds {

/// The writer of announcements (DDSI-RTPS 9.3.1.5).
inline constexpr std::uint32_t kAnnouncements = 0x000100c2;

struct Data {
  std::uint32_t writer = 0;
  bool ends = false;  ///< of the instance
  std::span<const std::uint8_t> payload;
};
/// @pre submessage is a DATA, and check_packet() has passed its datagram
Data read_data(const Submessage& submessage) noexcept;

/// Whether a participant says in it that it goes.
/// @param datagram  one that check_packet() has passed
/// Thread-safe: yes.   Real-time safe: yes.
bool says_goodbye(std::span<const std::uint8_t> datagram) noexcept;

}  // namespace gatefield::dds
