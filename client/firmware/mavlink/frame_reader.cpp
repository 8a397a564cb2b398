#include "client/firmware/mavlink/frame_reader.h"

#include <cstring>

#include "client/firmware/mavlink/frame_format.h"

namespace gatefield::firmware::mavlink {
namespace {

bool is_marker(std::uint8_t byte) noexcept { return byte == kMarker1 || byte == kMarker2; }

enum class Kind : std::uint8_t {
  kUnfinished,    ///< more bytes have to come
  kIncompatible,  ///< a flag of the future: nobody knows where it ends
  kUnknown,       ///< no definition, so its checksum can't be checked
  kBroken,        ///< the checksum is wrong
  kProven,        ///< the checksum is right
};

/// What a marker may begin.
struct Candidate {
  Kind kind = Kind::kUnfinished;
  std::size_t size = 0;  ///< of the whole frame; of an unfinished one 0
  std::span<const std::uint8_t> payload;
  Frame frame;  ///< but for the payload
};

/// @pre `bytes` begin with a marker
Candidate inspect(std::span<const std::uint8_t> bytes) noexcept {
  Candidate candidate;
  Frame& frame = candidate.frame;
  frame.version = bytes[0] == kMarker1 ? 1 : 2;
  const std::size_t header = frame.version == 1 ? kHeader1 : kHeader2;
  if (bytes.size() < header) return candidate;
  const std::size_t length = bytes[1];
  if (frame.version == 1) {
    frame.sequence = bytes[2];
    frame.from = {bytes[3], bytes[4]};
    frame.id = bytes[5];
  } else {
    if ((bytes[2] & ~kSignedFlag) != 0) {
      candidate.kind = Kind::kIncompatible;
      return candidate;
    }
    frame.is_signed = (bytes[2] & kSignedFlag) != 0;
    frame.sequence = bytes[4];
    frame.from = {bytes[5], bytes[6]};
    frame.id = bytes[7] | static_cast<std::uint32_t>(bytes[8]) << 8 | static_cast<std::uint32_t>(bytes[9]) << 16;
  }
  const std::size_t size = header + length + kChecksum + (frame.is_signed ? kSignature : 0);
  if (bytes.size() < size) return candidate;

  candidate.size = size;
  candidate.payload = bytes.subspan(header, length);
  const Definition* const definition = find_definition(frame.id);
  if (definition == nullptr) {
    candidate.kind = Kind::kUnknown;
    return candidate;
  }
  const auto checksum = bytes.subspan(header + length, kChecksum);
  const bool right = frame_checksum(bytes.first(header + length), definition->crc_extra) ==
                     (checksum[0] | static_cast<std::uint32_t>(checksum[1]) << 8);
  candidate.kind = right ? Kind::kProven : Kind::kBroken;
  return candidate;
}

/// Where a frame with a right checksum begins behind the first byte, among the first `limit`; 0: nowhere.
std::size_t proven_frame_behind(std::span<const std::uint8_t> bytes, std::size_t limit) noexcept {
  for (std::size_t at = 1; at < limit; ++at)
    if (is_marker(bytes[at]) && inspect(bytes.subspan(at)).kind == Kind::kProven) return at;
  return 0;
}

}  // namespace

std::size_t FrameReader::append(std::span<const std::uint8_t> bytes) noexcept {
  std::memmove(buffer_.data(), buffer_.data() + begin_, end_ - begin_);
  end_ -= begin_;
  begin_ = 0;
  const std::size_t taken = std::min(bytes.size(), buffer_.size() - end_);
  std::ranges::copy(bytes.first(taken), buffer_.begin() + static_cast<std::ptrdiff_t>(end_));
  end_ += taken;
  return taken;
}

void FrameReader::skip_noise(std::size_t count) noexcept {
  counts_.noise_bytes += count;
  begin_ += count;
}

void FrameReader::drop_rest() noexcept {
  counts_.noise_bytes += waiting().size();
  begin_ = end_ = 0;
}

void FrameReader::watch_sequence(const Frame& frame) noexcept {
  const auto begin = senders_.begin();
  const auto end = begin + static_cast<std::ptrdiff_t>(sender_count_);
  const auto sender = std::find_if(begin, end, [&](const Sender& known) { return known.address == frame.from; });
  if (sender != end) {
    counts_.lost += static_cast<std::uint8_t>(frame.sequence - sender->sequence - 1);
    sender->sequence = frame.sequence;
  } else if (sender_count_ < senders_.size()) {
    senders_[sender_count_++] = {frame.from, frame.sequence};
  }
}

std::optional<Frame> FrameReader::next(bool at_end) noexcept {
  for (;;) {
    skip_noise(static_cast<std::size_t>(std::ranges::find_if(waiting(), is_marker) - waiting().begin()));
    const auto bytes = waiting();
    if (bytes.empty()) return std::nullopt;
    Candidate candidate = inspect(bytes);
    switch (candidate.kind) {
      case Kind::kProven:
        return take(&candidate.frame, candidate.payload, candidate.size);
      case Kind::kBroken:
        ++counts_.bad_checksums;
        skip_noise(1);
        break;
      case Kind::kIncompatible:
        ++counts_.incompatible;
        skip_noise(1);
        break;
      case Kind::kUnfinished:
        if (const std::size_t behind = proven_frame_behind(bytes, bytes.size()); behind > 0) {
          skip_noise(behind);
        } else {
          if (!at_end) return std::nullopt;
          skip_noise(1);
        }
        break;
      case Kind::kUnknown: {
        const bool last = bytes.size() == candidate.size;
        if (const std::size_t behind = proven_frame_behind(bytes, candidate.size); behind > 0) {
          skip_noise(behind);
        } else if (last && !at_end) {
          return std::nullopt;  // what follows tells
        } else if (last || is_marker(bytes[candidate.size])) {
          ++counts_.unknown;
          watch_sequence(candidate.frame);
          begin_ += candidate.size;
        } else {
          skip_noise(1);
        }
        break;
      }
    }
  }
}

Frame FrameReader::take(Frame* frame, std::span<const std::uint8_t> payload, std::size_t size) noexcept {
  // A later version of the definition may have more fields than are known here.
  const std::size_t known = std::min<std::size_t>(payload.size(), find_definition(frame->id)->payload_length);
  std::ranges::copy(payload.first(known), frame->payload.begin());
  ++counts_.frames;
  if (frame->is_signed) ++counts_.signed_frames;
  watch_sequence(*frame);
  begin_ += size;
  return *frame;
}

}  // namespace gatefield::firmware::mavlink
