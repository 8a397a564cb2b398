#include "client/simulator/px4_lockstep.h"

#include <thread>
#include <utility>

#include "client/simulator/plant.h"

namespace gatefield::simulator {
namespace {

using namespace std::chrono_literals;

const MonotonicClock kWall;

constexpr Stamp kSlip = 100ms;  // a machine later than this is not made up for
constexpr Stamp kLook = 200us;  // how often somebody looks who waits for the simulation's time

}  // namespace

Stamp SteppedClock::sleep_until(Stamp deadline) noexcept {
  for (Stamp time = now();; time = now()) {
    if (time >= deadline) return time;
    std::this_thread::sleep_for(kLook);
  }
}

Result<std::unique_ptr<Px4Exchange>> Px4Lockstep::open(const Px4Options& options, std::uint64_t seed) {
  auto hil = firmware::HilLink::open(options.hil);
  if (!hil) return hil.failure();
  return std::unique_ptr<Px4Exchange>(new Px4Lockstep(options, seed, std::move(hil).value()));
}

Px4Lockstep::Px4Lockstep(const Px4Options& options, std::uint64_t seed, std::unique_ptr<firmware::HilLink> hil)
    : pace_(options.pace), hil_(std::move(hil)), senses_(options.sensors, seed) {}

Status Px4Lockstep::begin(const QuadrotorState& held) {
  while (!hil_->answered() && !broken_) advance(held);
  return broken_ ? Status(*broken_) : Status();
}

/// Who joins waits for answers, which need PX4's time to go on.
Status Px4Lockstep::meanwhile(const QuadrotorState& held, const std::function<Status()>& join) {
  std::jthread time([&](const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      if (broken_) std::this_thread::sleep_for(Plant::kStep);  // who waits for answers has to come to the end of it
      advance(held);
    }
  });
  const Status joined = join();
  time.request_stop();
  time.join();
  return broken_ ? Status(*broken_) : joined;
}

void Px4Lockstep::advance(const QuadrotorState& state) noexcept {
  const Stamp now = clock_.now();
  if (now >= next_sample_ && !broken_) {
    next_sample_ += kSample;
    keep_pace();
    const auto sample = senses_.take(now, state);
    auto motors = hil_->exchange(sample.sensor, sample.satellites, sample.truth);
    if (motors) {
      motors_ = *motors;
    } else {
      broken_ = motors.failure();
    }
  }
  clock_.advance(Plant::kStep);
}

void Px4Lockstep::keep_pace() noexcept {
  const Stamp now = clock_.now(), wall = kWall.now();
  const Stamp due = paced_wall_ + from_seconds(seconds(now - paced_at_) / pace_);
  if (paced_wall_ == Stamp{0} || wall - due > kSlip) {
    paced_at_ = now;
    paced_wall_ = wall;
  } else if (wall < due) {
    std::this_thread::sleep_for(due - wall);
  }
}

}  // namespace gatefield::simulator
