#include "client/simulator/px4_real_time.h"

#include <algorithm>
#include <utility>

#include "client/simulator/plant.h"

namespace gatefield::simulator {

Result<std::unique_ptr<Px4Exchange>> Px4RealTime::open(const Px4Options& options, std::uint64_t seed) {
  auto link = firmware::open(firmware::parse_address(options.hil.address).value(), options.hil.connect_timeout);
  if (!link) return link.failure();
  return std::unique_ptr<Px4Exchange>(new Px4RealTime(options, seed, std::move(link).value()));
}

Px4RealTime::Px4RealTime(const Px4Options& options, std::uint64_t seed, std::unique_ptr<firmware::Link> link)
    : link_(std::move(link)),
      board_(options.hil, link_.taker(), std::make_unique<MonotonicClock>()),
      senses_(options.sensors, seed),
      sample_period_(from_seconds(1.0 / options.hil.sample_rate_hz)) {}

Status Px4RealTime::begin(const QuadrotorState&) { return board_.connect(); }

/// The board's time goes on by itself; it does without sensors for that long.
Status Px4RealTime::meanwhile(const QuadrotorState&, const std::function<Status()>& join) {
  Status joined = join();
  const auto motors = board_.hear();
  return motors ? std::move(joined) : Status(motors.failure());  // a port that is gone says more than who waited for it
}

void Px4RealTime::advance(const QuadrotorState& state) noexcept {
  simulated_ += Plant::kStep;
  if (broken_) return;
  if (Status status = exchange(state); !status) broken_ = status.failure();
}

Status Px4RealTime::exchange(const QuadrotorState& state) {
  const Stamp now = clock_.now();
  if (now >= next_sample_) {
    next_sample_ = std::max(next_sample_ + sample_period_, now);  // who was late owes nothing
    const auto sample = senses_.take(simulated_, state);
    if (Status status = board_.send(sample.sensor, sample.satellites); !status) return status;
  }
  auto motors = board_.hear();
  if (!motors) return motors.failure();
  motors_ = *motors;
  return {};
}

void Px4RealTime::rest() noexcept { clock_.sleep_until(clock_.now() + Plant::kStep); }

}  // namespace gatefield::simulator
