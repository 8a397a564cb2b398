#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "common/base/clock.h"
#include "common/base/result.h"

namespace gatefield::bridge {

struct TimeSyncOptions {
  Stamp ask_every{std::chrono::milliseconds(100)};          ///< 10 ms to 1 s
  Stamp longest_round_trip{std::chrono::milliseconds(30)};  ///< beyond it nothing is believed; 1 ms to 1 s
  double most_drift_ppm = 500.0;                            ///< of the clocks against each other; 1 to 10000
};

/// Says which field is wrong and why.
Status validate(const TimeSyncOptions& options);

/// Another machine's clock against ours, from questions and answers (MAVLink's TIMESYNC).
///
/// An answer that we asked for at t_0 and heard at t_1, with the other's time r in it, gives offset
/// r - (t_0 + t_1) / 2, wrong by at most half the round trip t_1 - t_0: whatever the two ways took, r lies between. The
/// line
///
///   offset(t) = a + b (t - t_n)
///
/// is fitted by least squares to the answers of the last kWindow whose round trips are near the shortest of them
/// (weights 1 / (round trip)^2); b is 0 until they span kDriftSpan. Seldom answers that a queue held up are left out
/// that way, as by NTP's clock filter (RFC 5905, section 10).
///
/// An answer that contradicts the line by more than both their errors, kRestart times in a row, begins anew: the other
/// machine has restarted or set its clock.
/// Thread-safe: no.   Real-time safe: yes.   Errors: none; what is impossible is left out and counted.
class TimeSync {
 public:
  static constexpr std::size_t kWindow = 32;
  static constexpr std::size_t kEnough = 5;  ///< answers before it is believed
  static constexpr int kRestart = 4;
  static constexpr Stamp kDriftSpan{std::chrono::seconds(2)};
  static constexpr Stamp kSilent{std::chrono::seconds(5)};  ///< without an answer it is believed no longer

  /// @pre validate(options)
  explicit TimeSync(const TimeSyncOptions& options) noexcept : options_(options) {}

  /// True when it is time to ask; it is taken as asked then.
  bool ask(Stamp now) noexcept;
  /// @param asked  ts1 of the answer: our own time when we asked
  /// @param theirs  tc1 of the answer
  void on_answer(Stamp now, Stamp asked, Stamp theirs) noexcept;

  /// Their stamp in our time; empty: not believed (see trouble()).
  std::optional<Stamp> ours(Stamp now, Stamp theirs) const noexcept;

  /// Why stamps are not translated.
  enum class Trouble : std::uint8_t {
    kNone,
    kNoAnswers,  ///< too few, or none for kSilent
    kRoundTrip,  ///< longer than allowed
    kDrift,      ///< faster than allowed
  };
  Trouble trouble(Stamp now) const noexcept;

  Stamp offset() const noexcept { return offset_; }                  ///< theirs less ours, of the newest answer's time
  double drift_ppm() const noexcept { return drift_ * 1e6; }         ///< above 0: their clock is faster
  Stamp round_trip() const noexcept { return shortest_; }            ///< the shortest of the window
  std::uint64_t answers() const noexcept { return answers_; }        ///< believable ones
  std::uint64_t impossible() const noexcept { return impossible_; }  ///< not asked for, or from the future
  std::uint64_t restarts() const noexcept { return restarts_; }

 private:
  struct Answer {
    Stamp at{0}, offset{0}, round_trip{0};
  };
  Stamp offset_at(Stamp now) const noexcept;
  void add(const Answer& answer) noexcept;
  void fit() noexcept;

  TimeSyncOptions options_;
  std::optional<Stamp> asked_;
  std::array<Answer, kWindow> window_{};
  std::size_t size_ = 0, next_ = 0;
  int contradictions_ = 0;
  Stamp at_{0}, offset_{0}, shortest_{0};
  double drift_ = 0.0;
  std::uint64_t answers_ = 0, impossible_ = 0, restarts_ = 0;
};

/// The trouble in words, with the figure and the next step. Ok for kNone.
Status describe(TimeSync::Trouble trouble, Stamp round_trip, double drift_ppm, const TimeSyncOptions& options);

}  // namespace gatefield::bridge
