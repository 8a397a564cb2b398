#pragma once

#include <cstdint>

#include "common/base/clock.h"

namespace gatefield::pilot {

/// The order of one vehicle's samples of one kind, by their sequence numbers and stamps (the client's clock): what goes
/// on along the line is taken, what is late is left out, and one sample that lies elsewhere - a stamp of 2^63 - 1, a
/// number far ahead, a clock that went back - does no harm. When kAgree samples in a row go on from each other
/// elsewhere, the line is taken up there: the client's clock or count has begun anew, or the first sample of all was
/// the bad one.
///
/// A sample goes on from another when its sequence is more, by at most kMaxSkip, and its stamp is later, by at most
/// kMaxJump and what passed meanwhile by the receiver's clock. It is late when neither is more and the stamp is at most
/// kMaxJump back. A lockstep client (`free`) may let kMaxFreeJump of its own time pass between two samples, however
/// fast it computes, and sends the same sample again until it is answered: off the line, the same one again agrees with
/// itself. A stamp beyond kMaxStamp lies on no line.
/// Thread-safe: no (the owner's lock).   Real-time safe: yes.
class TimeLine {
 public:
  static constexpr std::uint64_t kMaxSkip = 100'000;
  static constexpr Stamp kMaxJump = std::chrono::seconds(1);
  static constexpr Stamp kMaxFreeJump = std::chrono::minutes(10);  ///< a simulator leaps no farther at once
  /// 146 years: times that are added to a stamp don't reach the end of its 64 bits.
  /// What plans begin at is later by the state's age and the delay, and within the 2^62 ns that a command may say.
  static constexpr Stamp kMaxStamp = Stamp::max() / 2 - std::chrono::seconds(1000);
  static constexpr int kAgree = 3;

  enum class Verdict {
    kNext,      ///< goes on along the line, or is the first of all
    kRepeated,  ///< the newest one again
    kLate,      ///< older than the newest
    kOff,       ///< lies elsewhere: not to be used
    kNewLine,   ///< the last of kAgree that lie elsewhere: the line goes on from here; whoever keeps stamps begins anew
  };

  /// The sample is to be used.
  static constexpr bool taken(Verdict verdict) noexcept {
    return verdict == Verdict::kNext || verdict == Verdict::kNewLine;
  }

  /// @param received  receiver's clock
  /// @param free      lockstep: stamps don't follow the receiver's clock and may be kMaxFreeJump after the last one
  Verdict judge(std::uint64_t sequence, Stamp stamp, Stamp received, bool free) noexcept;

  bool begun() const noexcept { return state_.begun; }
  /// That was taken. @pre begun()
  std::uint64_t last_sequence() const noexcept { return state_.newest.sequence; }
  Stamp last_stamp() const noexcept { return state_.newest.stamp; }

  struct Point {
    std::uint64_t sequence = 0;
    Stamp stamp{0};
    Stamp received{0};
  };
  /// All there is: to be written down, and set to what was.
  struct State {
    bool begun = false;
    Point newest;      ///< that was taken
    Point elsewhere;   ///< the newest that lies off the line
    int agreeing = 0;  ///< how many in a row lie there
  };
  const State& state() const noexcept { return state_; }
  void restore(const State& state) noexcept { state_ = state; }

 private:
  static bool goes_on(const Point& from, const Point& to, bool free) noexcept;

  State state_;
};

}  // namespace gatefield::pilot
