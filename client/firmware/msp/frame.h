#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

/// MSP, the protocol that Betaflight and its relatives speak over serial ports and TCP: who asks sends a command, the
/// flight controller answers with the same number. Written from the description of the protocol in the Betaflight
/// documentation and the behaviour of 4.4 to 2026.6; both versions of the frame, numbers little endian:
///
///   version 1   '$' 'M' way   u8 size   u8 command   payload   u8 xor of size, command and payload
///               a size of 255 says that a u16 with the real size follows the command (in answers only)
///   version 2   '$' 'X' way   u8 flags (0)   u16 command   u16 size   payload   u8 CRC-8/DVB-S2 (polynomial 0xD5, from
///               0) of flags, command, size and payload
///   way         '<' to the flight controller, '>' from it, '!' it does not know the command or refuses it
namespace gatefield::firmware::msp {

enum class Way : std::uint8_t { kQuestion = '<', kAnswer = '>', kRefusal = '!' };
enum class Version : std::uint8_t { k1 = 'M', k2 = 'X' };

/// Longest payload that is sent and heard. Longer answers exist (texts for configurators), none that is asked for here.
inline constexpr std::size_t kMaxPayload = 254;
inline constexpr std::size_t kMaxFrame = kMaxPayload + 9;

struct Frame {
  Way way = Way::kQuestion;
  Version version = Version::k2;
  std::uint16_t command = 0;
  std::span<const std::uint8_t> payload;
};

/// Writes a frame. @return its bytes, at the beginning of `buffer`
/// Thread-safe: yes.   Real-time safe: yes.
/// @pre payload.size() <= kMaxPayload; version 1: command < 255
std::span<const std::uint8_t> encode(const Frame& frame, std::span<std::uint8_t, kMaxFrame> buffer) noexcept;

/// CRC-8/DVB-S2, continued from `crc`.
std::uint8_t crc8_dvb_s2(std::uint8_t crc, std::span<const std::uint8_t> bytes) noexcept;

/// Finds frames in what a link brings, whatever lies between them and wherever it is cut. Bytes that turn out to be no
/// frame are looked through again from their second one, so a frame is found even behind a beginning that was garbage,
/// at the latest kMaxFrame bytes later.
/// Thread-safe: no.   Real-time safe: yes.
class FrameReader {
 public:
  /// Where the next bytes of the link go; never empty after next() has said that there is no further frame.
  std::span<std::uint8_t> room() noexcept;
  /// So many bytes were put there.
  void filled(std::size_t count) noexcept;

  /// The next frame, until there is none. Its payload is valid until room() is called.
  std::optional<Frame> next() noexcept;

  /// The rest of what has begun is not coming: what is there is looked through again without its beginning.
  /// @return false: nothing is there
  bool give_up() noexcept;

  /// Bytes so far that belonged to no frame.
  std::uint64_t skipped() const noexcept { return skipped_; }

 private:
  std::array<std::uint8_t, 4 * kMaxFrame> bytes_{};
  std::size_t begin_ = 0, end_ = 0;  // what was not looked at
  std::uint64_t skipped_ = 0;
};

}  // namespace gatefield::firmware::msp
