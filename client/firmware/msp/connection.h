#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "client/firmware/link/link.h"
#include "client/firmware/msp/frame.h"
#include "common/base/clock.h"
#include "common/base/result.h"

namespace gatefield::firmware::msp {

/// Commands to a flight controller and its answers, over one link.
///
/// A flight controller takes up one command in each run of its serial task (100 a second as it comes, more with its
/// setting serial_update_rate_hz), and what it can't take up waits in its buffer. So that nothing grows old there, only
/// kMaxWaiting commands are ever without an answer: send() refuses more. An answer that has not come after four times
/// the longest of the round trips of late, but kShortest at least and kLongest at most, is taken for lost; then the
/// rest of a frame that has begun is no longer waited for, either.
///
/// Thread-safe: no.   Real-time safe: all but ask() (system calls, no allocation).
class Connection {
 public:
  static constexpr std::size_t kMaxWaiting = 2;
  static constexpr std::chrono::milliseconds kShortest{40}, kLongest{250};

  /// @param link  not null
  Connection(std::unique_ptr<Link> link, const Clock& clock);

  /// Sends a command and waits for its answer; others that come meanwhile are dropped. Asks again every 0.2 s until
  /// `timeout`, so it is for commands that may be followed twice.
  /// Errors: kNoAnswer when the link broke or nothing came, kUnsupported when the flight controller refused; field
  /// "link", and a sentence with the next step.
  Result<std::vector<std::uint8_t>> ask(std::uint16_t command, std::span<const std::uint8_t> payload,
                                        std::chrono::nanoseconds timeout);
  Result<std::vector<std::uint8_t>> ask(std::uint16_t command, std::chrono::nanoseconds timeout) {
    return ask(command, {}, timeout);
  }

  /// @return false: too many are without an answer, the link takes nothing now, or it is broken
  bool send(std::uint16_t command, std::span<const std::uint8_t> payload) noexcept;

  /// The next answer that has come, until there is none. Its payload is valid until the next call.
  std::optional<Frame> next() noexcept;

  std::size_t waiting() const noexcept { return waiting_; }
  /// Newest time from a command to its answer; empty: none came yet.
  std::optional<std::chrono::nanoseconds> round_trip() const noexcept { return round_trip_; }
  std::uint64_t answers() const noexcept { return answers_; }
  std::uint64_t refusals() const noexcept { return refusals_; }
  std::uint64_t lost() const noexcept {
    return lost_;
  }  ///< commands without an answer, and answers that nobody asked for
  std::uint64_t noise_bytes() const noexcept { return reader_.skipped(); }
  /// What the link broke of; empty: it works.
  std::optional<Error> failure() const;
  const std::string& name() const noexcept { return link_->name(); }

 private:
  struct Sent {
    std::uint16_t command = 0;
    Stamp when{0};
  };
  void forget_lost(Stamp now) noexcept;
  void forget_first(std::size_t count) noexcept;
  void answered(const Frame& frame, Stamp now) noexcept;
  void note(std::chrono::nanoseconds round_trip) noexcept;
  void fetch() noexcept;
  void put_out(Transfer transfer) noexcept;

  const std::unique_ptr<Link> link_;
  const Clock& clock_;
  FrameReader reader_;
  std::array<Sent, kMaxWaiting> sent_{};  // oldest first
  std::size_t waiting_ = 0;
  std::optional<std::chrono::nanoseconds> round_trip_;
  std::chrono::nanoseconds patience_ = kLongest;
  std::uint64_t answers_ = 0, refusals_ = 0, lost_ = 0;
  Transfer broken_;
};

}  // namespace gatefield::firmware::msp
