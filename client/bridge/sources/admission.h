#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string>

#include "client/bridge/sources/options.h"

namespace gatefield::bridge::sources {

/// When a message came, by both clocks.
struct Moment {
  Stamp now{0};                      ///< the loop's
  std::chrono::nanoseconds wall{0};  ///< the system's, since 1970
};

/// Why a message was not taken.
enum class Refusal : std::uint8_t {
  kMalformed,    ///< it is wrong in itself
  kFrame,        ///< its frame_id is another one
  kSize,         ///< the image is not of the camera's size
  kFuture,       ///< its stamp lies ahead of now
  kOld,          ///< its stamp lies too far back
  kNotRising,    ///< it is not newer than the last one
  kTwoPrograms,  ///< another program publishes it, too
};
inline constexpr std::size_t kRefusals = 7;

/// Who may speak on a topic, and when what it says held.
///
/// A stamp more than kFuture ahead of this machine's clock, or more than `oldest` behind, is wrong: clocks that do not
/// agree, or a network that holds messages back. A constant error below these bounds can't be seen from here, and is
/// flown as delay.
/// The first program that publishes is the one; another is refused until the first was silent for kSilent.
/// Thread-safe: one thread in admit() and refuse(), any in the rest.   Real-time safe: admit() yes.
class Admission {
 public:
  static constexpr Stamp kFuture{std::chrono::milliseconds(10)};
  static constexpr Stamp kSilent{std::chrono::milliseconds(500)};

  /// @pre validate() of the options that it is part of
  explicit Admission(const TimeOptions& options) noexcept : options_(options) {}

  /// @param stamp  of the message, since 1970   @return by the loop's clock; empty: refused, and counted
  std::optional<Stamp> admit(const Moment& moment, std::chrono::nanoseconds stamp, std::uint64_t program) noexcept;
  /// Counts a message that is wrong otherwise. @param why  kept for the sentence
  void refuse(Refusal reason, const Error& why);

  std::uint64_t taken() const noexcept { return taken_; }
  std::uint64_t refused(Refusal reason) const noexcept { return refused_[static_cast<std::size_t>(reason)]; }
  /// Of the last one taken: how old it was when it came.
  Stamp age() const noexcept { return Stamp(age_ns_); }
  /// Messages a second, of late; 0: too few came.
  double rate_hz() const noexcept;
  /// What keeps messages from being taken, with the next step; empty: nothing of late. The most frequent reason.
  /// @param topic  for the sentence. Not real-time safe.
  std::optional<Error> complaint(const std::string& topic) const;

 private:
  std::optional<Stamp> refuse(Refusal reason) noexcept;

  const TimeOptions options_;
  std::optional<Stamp> last_;  // of the last message taken
  Stamp last_heard_{0};        // when it came
  std::uint64_t program_ = 0;  // who sent it
  std::atomic<std::uint64_t> taken_{0};
  std::atomic<std::int64_t> age_ns_{0}, wrong_age_ns_{0}, spacing_ns_{0};
  std::array<std::atomic<std::uint64_t>, kRefusals> refused_{};
  mutable std::mutex mutex_;
  std::optional<Error> why_;  // of the last refusal that had a sentence
};

}  // namespace gatefield::bridge::sources
