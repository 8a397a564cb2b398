#include "client/firmware/msp/frame.h"

#include <algorithm>
#include <cassert>

namespace gatefield::firmware::msp {
namespace {

constexpr std::size_t kHeader1 = 5, kHeader2 = 8;
constexpr std::uint8_t kJumbo = 255;

std::uint8_t exclusive_or(std::span<const std::uint8_t> bytes) noexcept {
  std::uint8_t all = 0;
  for (const std::uint8_t byte : bytes) all ^= byte;
  return all;
}

std::uint16_t u16(std::span<const std::uint8_t> bytes, std::size_t at) noexcept {
  return static_cast<std::uint16_t>(bytes[at] | bytes[at + 1] << 8);
}

/// What stands at the beginning of some bytes.
struct Found {
  enum class Kind { kFrame, kNothing, kCut } kind = Kind::kNothing;
  Frame frame;
  std::size_t size = 0;
};

Found with_payload(Frame frame, std::span<const std::uint8_t> bytes, std::size_t header, std::size_t size) noexcept {
  if (size > kMaxPayload) return {};
  if (bytes.size() < header + size + 1) return {Found::Kind::kCut, {}, 0};
  const auto summed = bytes.subspan(3, header - 3 + size);
  const std::uint8_t sum = frame.version == Version::k1 ? exclusive_or(summed) : crc8_dvb_s2(0, summed);
  if (sum != bytes[header + size]) return {};
  frame.payload = bytes.subspan(header, size);
  return {Found::Kind::kFrame, frame, header + size + 1};
}

Found find(std::span<const std::uint8_t> bytes) noexcept {
  const Found cut{Found::Kind::kCut, {}, 0};
  if (bytes[0] != '$') return {};
  if (bytes.size() < 2) return cut;
  Frame frame;
  frame.version = static_cast<Version>(bytes[1]);
  if (frame.version != Version::k1 && frame.version != Version::k2) return {};
  if (bytes.size() < 3) return cut;
  frame.way = static_cast<Way>(bytes[2]);
  if (frame.way != Way::kQuestion && frame.way != Way::kAnswer && frame.way != Way::kRefusal) return {};

  if (frame.version == Version::k2) {
    if (bytes.size() < kHeader2) return cut;
    frame.command = u16(bytes, 4);
    return with_payload(frame, bytes, kHeader2, u16(bytes, 6));
  }
  if (bytes.size() < kHeader1) return cut;
  frame.command = bytes[4];
  if (bytes[3] != kJumbo) return with_payload(frame, bytes, kHeader1, bytes[3]);
  if (bytes.size() < kHeader1 + 2) return cut;
  return with_payload(frame, bytes, kHeader1 + 2, u16(bytes, kHeader1));
}

}  // namespace

std::uint8_t crc8_dvb_s2(std::uint8_t crc, std::span<const std::uint8_t> bytes) noexcept {
  constexpr unsigned kPolynomial = 0xD5;
  for (const std::uint8_t byte : bytes) {
    crc ^= byte;
    for (int bit = 0; bit < 8; ++bit) crc = static_cast<std::uint8_t>((crc << 1) ^ ((crc & 0x80) ? kPolynomial : 0));
  }
  return crc;
}

std::span<const std::uint8_t> encode(const Frame& frame, std::span<std::uint8_t, kMaxFrame> buffer) noexcept {
  assert(frame.payload.size() <= kMaxPayload);
  assert(frame.version == Version::k2 || frame.command < kJumbo);
  std::size_t at = 0;
  const auto put = [&](unsigned byte) { buffer[at++] = static_cast<std::uint8_t>(byte); };
  const auto size = static_cast<unsigned>(frame.payload.size());
  put('$');
  put(static_cast<unsigned>(frame.version));
  put(static_cast<unsigned>(frame.way));
  if (frame.version == Version::k1) {
    put(size);
    put(frame.command);
  } else {
    put(0);
    put(frame.command);
    put(frame.command >> 8);
    put(size);
    put(size >> 8);
  }
  std::copy(frame.payload.begin(), frame.payload.end(), buffer.begin() + static_cast<std::ptrdiff_t>(at));
  at += frame.payload.size();
  const auto summed = buffer.subspan(3, at - 3);
  put(frame.version == Version::k1 ? exclusive_or(summed) : crc8_dvb_s2(0, summed));
  return buffer.first(at);
}

std::span<std::uint8_t> FrameReader::room() noexcept {
  std::copy(bytes_.begin() + static_cast<std::ptrdiff_t>(begin_), bytes_.begin() + static_cast<std::ptrdiff_t>(end_),
            bytes_.begin());
  end_ -= begin_;
  begin_ = 0;
  return std::span(bytes_).subspan(end_);
}

void FrameReader::filled(std::size_t count) noexcept {
  assert(count <= bytes_.size() - end_);
  end_ += count;
}

std::optional<Frame> FrameReader::next() noexcept {
  while (begin_ < end_) {
    const Found found = find(std::span<const std::uint8_t>(bytes_).subspan(begin_, end_ - begin_));
    if (found.kind == Found::Kind::kCut) return std::nullopt;
    if (found.kind == Found::Kind::kFrame) {
      begin_ += found.size;
      return found.frame;
    }
    ++begin_;
    ++skipped_;
  }
  return std::nullopt;
}

bool FrameReader::give_up() noexcept {
  if (begin_ == end_) return false;
  ++begin_;
  ++skipped_;
  return true;
}

}  // namespace gatefield::firmware::msp
