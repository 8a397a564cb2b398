#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "client/firmware/mavlink/frame.h"

namespace gatefield::firmware::mavlink {

/// What a reader met since its begin.
struct ReaderCounts {
  std::uint64_t frames = 0;         ///< given
  std::uint64_t lost = 0;           ///< missing between two frames of one sender, by their sequences
  std::uint64_t bad_checksums = 0;  ///< known messages whose checksum was wrong: noise, or a definition other than ours
  std::uint64_t unknown = 0;        ///< frames of messages that are not known here; their checksum can't be checked
  std::uint64_t signed_frames =
      0;  ///< of those given: with a signature, which is not checked. Who signs may hear nobody
          ///< who doesn't
  std::uint64_t incompatible = 0;  ///< frames with a flag of a future version, dropped
  std::uint64_t noise_bytes = 0;   ///< dropped between frames
};

/// Finds the frames in a stream of bytes, versions 1 and 2 mixed, however the bytes are cut into reads. Garbage, cut
/// and broken frames cost themselves and nothing else: on anything wrong the search goes on one byte behind the marker,
/// and a whole frame with a right checksum is given even where an unfinished or unknown one seems to be around it.
///
/// The frame of an unknown message is stepped over when a marker or the packet's end follows it.
/// Thread-safe: no.   Real-time safe: yes.
class FrameReader {
 public:
  /// @param whole_packet  the bytes are a datagram: frames don't go on in the next one
  /// @param sink  called with each frame, in order
  template <typename Sink>
  void read(std::span<const std::uint8_t> bytes, bool whole_packet, Sink&& sink) {
    while (!bytes.empty()) {
      const std::size_t taken = append(bytes);
      bytes = bytes.subspan(taken);
      while (const auto frame = next(whole_packet && bytes.empty())) sink(*frame);
    }
    if (whole_packet) drop_rest();
  }

  const ReaderCounts& counts() const noexcept { return counts_; }

 private:
  std::size_t append(std::span<const std::uint8_t> bytes) noexcept;
  std::optional<Frame> next(bool at_end) noexcept;
  void drop_rest() noexcept;
  Frame take(Frame* frame, std::span<const std::uint8_t> payload, std::size_t size) noexcept;
  void skip_noise(std::size_t count) noexcept;
  void watch_sequence(const Frame& frame) noexcept;
  std::span<const std::uint8_t> waiting() const noexcept { return {buffer_.data() + begin_, end_ - begin_}; }

  /// The last sequence of each sender; who comes when all places are taken is not watched.
  struct Sender {
    Address address;
    std::uint8_t sequence = 0;
  };

  std::array<std::uint8_t, 4 * kLongestFrame> buffer_{};
  std::size_t begin_ = 0, end_ = 0;
  std::array<Sender, 16> senders_{};
  std::size_t sender_count_ = 0;
  ReaderCounts counts_;
};

}  // namespace gatefield::firmware::mavlink
