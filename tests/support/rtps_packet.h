#pragma once

#include <cstdint>
#include <initializer_list>
#include <string>
#include <vector>

namespace gatefield::test {

/// Packets of RTPS put together byte by byte, little endian, as if from Fast DDS unless told otherwise.
class RtpsPacket {
 public:
  explicit RtpsPacket(std::initializer_list<int> vendor = {0x01, 0x0f}) {
    for (const char c : std::string("RTPS")) bytes_.push_back(static_cast<std::uint8_t>(c));
    u8({2, 3}).u8(vendor);
    for (int i = 0; i < 12; ++i) u8({i + 1});
  }
  RtpsPacket& u8(std::initializer_list<int> values) {
    for (const int value : values) bytes_.push_back(static_cast<std::uint8_t>(value));
    return *this;
  }
  RtpsPacket& u16(unsigned value) { return number(value, 2); }
  RtpsPacket& u32(std::uint32_t value) { return number(value, 4); }
  RtpsPacket& zeros(std::size_t count) {
    bytes_.insert(bytes_.end(), count, std::uint8_t{0});
    return *this;
  }
  /// A sequence number: its high word first.
  RtpsPacket& sequence(std::int64_t value) {
    return u32(static_cast<std::uint32_t>(static_cast<std::uint64_t>(value) >> 32))
        .u32(static_cast<std::uint32_t>(static_cast<std::uint64_t>(value)));
  }
  /// A submessage's header; end() puts its length in.
  RtpsPacket& begin(int id, int flags = 1) {
    u8({id, flags | 1});
    length_at_ = bytes_.size();
    return u16(0);
  }
  RtpsPacket& end() {
    const std::size_t length = bytes_.size() - length_at_ - 2;
    bytes_[length_at_] = static_cast<std::uint8_t>(length & 0xff);
    bytes_[length_at_ + 1] = static_cast<std::uint8_t>(length >> 8);
    return *this;
  }
  const std::vector<std::uint8_t>& bytes() const { return bytes_; }

 private:
  RtpsPacket& number(std::uint32_t value, int bytes) {
    for (int i = 0; i < bytes; ++i) bytes_.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
    return *this;
  }

  std::vector<std::uint8_t> bytes_;
  std::size_t length_at_ = 0;
};

/// The packet of 88 bytes that ends a process whose Fast DDS 2.9.1 reads it: statistics (0x80) of zeros.
inline std::vector<std::uint8_t> deadly_packet() { return RtpsPacket().u8({0x80, 1}).u16(56).zeros(64).bytes(); }

}  // namespace gatefield::test
