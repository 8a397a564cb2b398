#pragma once

#include <cstdint>
#include <cstring>
#include <span>
#include <string>

namespace gatefield::test {

/// A second reader of RTPS messages, written without a look at the check's, that holds what the check has let through
/// against what the library is known to stumble over. OMG DDSI-RTPS 2.3, 8.3 and 9.4.
class RtpsWalk {
 public:
  /// @return what is wrong with a message that was let through; empty: nothing
  static std::string complaint(std::span<const std::uint8_t> message) { return RtpsWalk(message).walk(); }

 private:
  explicit RtpsWalk(std::span<const std::uint8_t> message) : message_(message) {}

  std::string walk() {
    if (message_.size() < 20 || std::memcmp(message_.data(), "RTPS\2", 5) != 0) return "no header of RTPS 2";
    const bool of_fast_dds = message_[6] == 1 && message_[7] == 15;
    for (std::size_t at = 20; at != message_.size();) {
      if (at + 4 > message_.size()) return "half a submessage's header";
      big_ = (message_[at + 1] & 1) == 0;
      const unsigned id = message_[at], flags = message_[at + 1];
      std::size_t bytes = number(at + 2, 2);
      if (bytes == 0 && id != 0x09 && id != 0x01) bytes = message_.size() - at - 4;
      if (at + 4 + bytes > message_.size()) return "a submessage beyond the end";
      if (of_fast_dds && id == 0x80) return "statistics, which the library asserts";
      body_ = at + 4;
      end_ = body_ + bytes;
      if (const std::string wrong = submessage(id, flags); !wrong.empty()) return wrong + in(id);
      at = end_;
      if (at != message_.size() && bytes % 4 != 0) return "a submessage that is not aligned" + in(id);
    }
    return "";
  }

  static std::string in(unsigned id) { return " in submessage " + std::to_string(id); }

  std::string submessage(unsigned id, unsigned flags) const {
    switch (id) {
      case 0x06:
        return has(20) ? set(16) : "cut";
      case 0x07: {
        if (!has(28)) return "cut";
        const long long first = sequence(8), last = sequence(16);
        return first >= 1 && last >= first - 1 && last - first <= 20'000'000 ? "" : "a range that can't be";
      }
      case 0x08: {
        if (!has(28)) return "cut";
        const long long first = sequence(8), base = sequence(16);
        if (first < 1 || base < first || base - first > 100'000) return "a range that no memory holds";
        return set(24);
      }
      case 0x12:
        return has(28) && sequence(8) >= 1 ? set(20) : "cut";
      case 0x13:
        return has(24) && sequence(8) >= 1 ? "" : "cut";
      case 0x15:
        return data(flags);
      case 0x16:
        return fragments(flags);
      default:
        return "";
    }
  }

  std::string data(unsigned flags) const {
    if (!has(20)) return "cut";
    if (sequence(12) < 1) return "a sequence number that can't be";
    std::size_t at = 4 + number(body_ + 2, 2);
    if ((flags & 2) != 0 && !parameters(&at)) return "a list without an end";
    if ((flags & 12) == 12) return "data and key";
    return body_ + at + ((flags & 12) != 0 ? 4 : 0) <= end_ ? "" : "a payload that isn't there";
  }

  std::string fragments(unsigned flags) const {
    if (!has(32)) return "cut";
    const unsigned long long first = number(body_ + 20, 4), count = number(body_ + 24, 2);
    const unsigned long long size = number(body_ + 26, 2), sample = number(body_ + 28, 4);
    if (sample > 8'000'000) return "a sample that no topic of ours has";
    if (first < 1 || size < 1 || (first + count - 2) * size >= sample) return "fragments that the sample doesn't have";
    std::size_t at = 4 + number(body_ + 2, 2);
    if ((flags & 2) != 0 && !parameters(&at)) return "a list without an end";
    if ((flags & 4) != 0) return "";
    unsigned long long bytes = count * size;
    if ((first + count - 1) * size > sample) bytes = sample - (first - 1) * size;
    return body_ + at + bytes <= end_ ? "" : "fragments without their bytes";
  }

  /// A set whose count stands at `at`, with its words behind it.
  std::string set(std::size_t at) const {
    if (!has(at + 4)) return "cut";
    const std::size_t count = number(body_ + at, 4);
    return count <= 256 && has(at + 4 + 4 * ((count + 31) / 32)) ? "" : "a set that is not there";
  }

  /// Behind the list that begins at *at. @return false: it has no end
  bool parameters(std::size_t* at) const {
    while (body_ + *at + 4 <= end_) {
      const unsigned id = number(body_ + *at, 2);
      const std::size_t bytes = number(body_ + *at + 2, 2);
      *at += 4;
      if (id == 1) return true;
      *at += bytes;
    }
    return false;
  }

  bool has(std::size_t bytes) const { return body_ + bytes <= end_; }
  long long sequence(std::size_t at) const {
    return static_cast<long long>(static_cast<std::uint64_t>(number(body_ + at, 4)) << 32 | number(body_ + at + 4, 4));
  }
  std::uint32_t number(std::size_t at, std::size_t bytes) const {
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < bytes; ++i) value = value << 8 | message_[at + (big_ ? i : bytes - 1 - i)];
    return value;
  }

  std::span<const std::uint8_t> message_;
  bool big_ = false;
  std::size_t body_ = 0, end_ = 0;
};

}  // namespace gatefield::test
