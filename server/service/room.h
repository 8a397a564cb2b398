#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/base/clock.h"
#include "server/planner/profile.h"
#include "server/service/costs.h"
#include "server/service/late_ticks.h"
#include "server/service/seats.h"

namespace gatefield::service {

struct RoomOptions {
  double utilisation = 0.0;  ///< part of the cores that vehicles may take; 0: nobody is refused or sent away for it
  double cores = 1.0;        ///< of this process
  int control_threads = 1;
  int perception_threads = 1;
};

/// What is read of a session each time the room is measured; counters since the session began.
struct SessionReading {
  std::uint64_t session = 0;
  std::string vehicle;
  const planner::Profile* profile = nullptr;
  double camera_rate_hz = 0.0;
  std::uint8_t priority = 0;
  bool real_time = true;
  bool heard = false;   ///< states come
  bool racing = false;  ///< Seat::racing
  std::uint64_t steps = 0, late = 0, narrow = 0, frames = 0;
  std::chrono::nanoseconds step_cpu{0}, look_cpu{0};
};

/// Processor time since the server began.
struct ServerReading {
  std::chrono::nanoseconds process{0}, control_threads{0}, helping{0}, perception_threads{0};
};

/// How much room a server has: what those who fly take as measured, what a newcomer would, and who goes when it is too
/// much.
///
/// A vehicle takes what its profile is known to cost (Costs) until it has been heard for kYoung, then what is measured
/// of it. One that isn't heard, such as a spare session beside another server's, takes nothing. Lockstep takes what is
/// left. Perception counts up to what its threads can do, since it skips frames. Measuring is a matter of processor
/// time, not of the clock's: other programs on the same cores change little in it, and show as late ticks (LateTicks).
/// These close the room by themselves, and teach how much the others leave: what was taken while ticks were late is the
/// most that may be taken for kHold, or kHoldShed when somebody had to go; then the most grows back slowly. Trying
/// costs ticks, so whoever has to go on the way back makes the next such time twice as long. While vehicles take less
/// than kBlameless of the capacity, other programs make ticks late: only an overload closes the room then, and for as
/// long as it is there.
/// Thread-safe: no (housekeeping).
class Room {
 public:
  static constexpr std::chrono::nanoseconds kYoung = std::chrono::seconds(2);
  static constexpr std::chrono::nanoseconds kHold = std::chrono::seconds(10);
  static constexpr std::chrono::nanoseconds kHoldShed = std::chrono::seconds(60);
  static constexpr std::chrono::nanoseconds kLongestHoldShed = std::chrono::minutes(16);
  static constexpr double kGrowth_per_s = 0.01;  ///< of the capacity
  static constexpr double kBlameless = 0.5;      ///< of the capacity

  Room(const RoomOptions& options, Costs costs);

  bool on() const noexcept { return options_.utilisation > 0.0; }

  /// To be called a few times a second.
  void measure(Stamp now, const std::vector<SessionReading>& sessions, const ServerReading& server);

  struct Newcomer {
    const planner::Profile* profile = nullptr;
    double camera_rate_hz = 0.0;
    std::uint8_t priority = 0;
    bool real_time = true;
    std::size_t places = 0;  ///< sessions that have to end before there is a place for it at all
  };
  struct Answer {
    bool fits = false;
    std::vector<std::uint64_t> displaced;  ///< sessions that have to end for it
    std::string why_not;                   ///< a sentence for it; empty when it fits
  };
  Answer ask(const Newcomer& newcomer) const;
  /// It has a session from now on.
  void enter(const Newcomer& newcomer, std::uint64_t session, const std::string& vehicle, Stamp now);
  void leave(std::uint64_t session);

  /// Whose session has to end now because control ticks are late, and the sentence for it.
  struct Shed {
    std::uint64_t session = 0;
    std::string why;
  };
  std::optional<Shed> shed(Stamp now);

  const LateTicks& late_ticks() const noexcept { return late_ticks_; }
  /// Whose tick was late most lately.
  const std::string& latest() const noexcept { return latest_; }
  double free() const;                            ///< cores for newcomers, at least 0
  double most() const noexcept { return most_; }  ///< that may be taken now
  double taken() const;
  Need cost_of(const planner::Profile& profile, double camera_rate_hz) const {
    return costs_.of(profile, camera_rate_hz);
  }

 private:
  /// Of a session, from one measurement to the next.
  struct History {
    SessionReading last;
    Stamp since{0};  ///< began, or was heard again
    bool measured = false;
    double control = 0.0, perception = 0.0;  ///< cores
  };
  Need load() const;
  double left_by(const Need& load) const;
  bool closed() const;
  void hold(Stamp until, double taken);
  void grow(double passed_s);
  void learn(const SessionReading& session, const SessionReading& before, double helped);
  std::string occupied() const;

  const RoomOptions options_;
  const Capacity capacity_;
  Costs costs_;
  LateTicks late_ticks_;
  std::string latest_;
  std::map<std::uint64_t, History> histories_;  // by session
  std::vector<Seat> seats_;                     // of those that take room
  double most_;                                 // cores that may be taken: the capacity, or what late ticks taught
  Stamp held_until_{0};                         // not more until then
  Stamp shed_held_until_{0};                    // the same, for somebody who had to go; 0: nobody had to, of late
  std::chrono::nanoseconds hold_shed_ = kHoldShed;
  double other_ = 0.0;  // cores of the middleware and all else, as measured
  Stamp measured_at_{0};
  ServerReading server_;
};

}  // namespace gatefield::service
