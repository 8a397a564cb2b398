#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/base/clock.h"
#include "server/service/costs.h"

/// Who may have room, and who gives way: decisions on figures, without a clock or a thread. All functions are pure.
namespace gatefield::service {

/// A vehicle that takes room.
struct Seat {
  std::uint64_t session = 0;
  std::string vehicle;
  std::uint8_t priority = 0;
  bool real_time = true;  ///< lockstep has no deadlines and takes what is left: it gives no room by going
  bool racing = false;    ///< has flown through a gate, and has gates before it
  Stamp since{0};         ///< since when it takes room
  Need need;
};

/// How much there is for vehicles, cores.
struct Capacity {
  double all = 0.0;
  double control = 0.0;     ///< on the control threads
  double perception = 0.0;  ///< that perception's threads can take at most: they skip frames rather than fall behind
};
/// @param utilisation  part of the cores that vehicles may take
Capacity capacity_of(double utilisation, double cores, int control_threads, int perception_threads);

/// How much of the capacity is free beside `load`; below 0 when it is more than there should be.
double free_cores(const Capacity& capacity, const Need& load);

/// Who goes first when somebody has to: those of the lowest priority; of them those that don't race; of them the
/// newest.
bool goes_before(const Seat& a, const Seat& b) noexcept;

/// Whom overload costs its seat. Nobody (empty) when at most one is there, and never one that races, unless somebody of
/// higher priority suffers. Only real-time seats are asked.
std::optional<std::size_t> shed_next(std::span<const Seat> seats);

/// Who must go to make room for a newcomer of `priority`: as few as suffice, in the order of goes_before(), all of
/// lower priority and in real time.
/// @param lacking  cores that have to become free   @param places  seats that have to
/// @return empty: they would not suffice. All that fly in real time always do: the newcomer is alone then
std::optional<std::vector<std::size_t>> displaced_by(std::span<const Seat> seats, std::uint8_t priority, double lacking,
                                                     std::size_t places);

}  // namespace gatefield::service
