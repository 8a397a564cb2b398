#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "client/firmware/mavlink/checksum.h"

/// How a frame is laid out, for who writes and who reads it (frame.h says it in words).
namespace gatefield::firmware::mavlink {

inline constexpr std::uint8_t kMarker1 = 0xFE;
inline constexpr std::uint8_t kMarker2 = 0xFD;
inline constexpr std::size_t kHeader1 = 6;
inline constexpr std::size_t kHeader2 = 10;
inline constexpr std::size_t kChecksum = 2;
inline constexpr std::size_t kSignature = 13;
inline constexpr std::uint8_t kSignedFlag = 0x01;  ///< of the incompatible flags; receivers refuse what others they see

/// @param frame  from the marker to the payload's end
constexpr std::uint16_t frame_checksum(std::span<const std::uint8_t> frame, std::uint8_t crc_extra) noexcept {
  Checksum checksum;
  checksum.add(frame.subspan(1));
  checksum.add(crc_extra);
  return checksum.value();
}

}  // namespace gatefield::firmware::mavlink
