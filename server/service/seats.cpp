#include "server/service/seats.h"

#include <algorithm>
#include <numeric>

namespace gatefield::service {

Capacity capacity_of(double utilisation, double cores, int control_threads, int perception_threads) {
  return {utilisation * cores, utilisation * std::min(cores, static_cast<double>(control_threads)),
          static_cast<double>(perception_threads)};
}

double free_cores(const Capacity& capacity, const Need& load) {
  const double taken = load.control + std::min(load.perception, capacity.perception) + load.other;
  return std::min(capacity.all - taken, capacity.control - load.control);
}

bool goes_before(const Seat& a, const Seat& b) noexcept {
  if (a.priority != b.priority) return a.priority < b.priority;
  if (a.racing != b.racing) return b.racing;
  return a.since > b.since;
}

std::optional<std::size_t> shed_next(std::span<const Seat> seats) {
  std::optional<std::size_t> first;
  std::size_t real_time = 0;
  std::uint8_t highest = 0;
  for (std::size_t i = 0; i < seats.size(); ++i) {
    if (!seats[i].real_time) continue;
    ++real_time;
    highest = std::max(highest, seats[i].priority);
    if (!first || goes_before(seats[i], seats[*first])) first = i;
  }
  if (real_time < 2 || (seats[*first].racing && seats[*first].priority == highest)) return std::nullopt;
  return first;
}

std::optional<std::vector<std::size_t>> displaced_by(std::span<const Seat> seats, std::uint8_t priority, double lacking,
                                                     std::size_t places) {
  std::vector<std::size_t> order(seats.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::erase_if(order, [&](std::size_t i) { return !seats[i].real_time || seats[i].priority >= priority; });
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return goes_before(seats[a], seats[b]); });
  std::vector<std::size_t> going;
  for (const std::size_t i : order) {
    if (lacking <= 0.0 && going.size() >= places) break;
    lacking -= seats[i].need.all();
    going.push_back(i);
  }
  const auto flying = std::count_if(seats.begin(), seats.end(), [](const Seat& seat) { return seat.real_time; });
  const bool alone = going.size() == static_cast<std::size_t>(flying);
  if ((lacking > 0.0 && !alone) || going.size() < places) return std::nullopt;
  return going;
}

}  // namespace gatefield::service
