#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>

#include "client/firmware/px4_hil/hil_link.h"
#include "client/simulator/px4_exchange.h"
#include "client/simulator/px4_options.h"
#include "client/simulator/px4_senses.h"
#include "common/base/clock.h"

namespace gatefield::simulator {

/// Time that one thread steps; others read it, and wait for it. Thread-safe: yes.
class SteppedClock final : public flight::LoopClock {
 public:
  Stamp now() const noexcept override { return Stamp(now_.load(std::memory_order_relaxed)); }
  Stamp sleep_until(Stamp deadline) noexcept override;
  void advance(Stamp span) noexcept { now_.fetch_add(span.count(), std::memory_order_relaxed); }

 private:
  std::atomic<std::int64_t> now_{0};
};

/// PX4's clock is the simulation's, and stands still while nobody steps. Every kSample a HIL_SENSOR goes out (and
/// HIL_GPS when one is due), and its motors are waited for. The truth goes with them, for its log.
/// Thread-safe: no.   Real-time safe: no (it waits for PX4).
class Px4Lockstep final : public Px4Exchange {
 public:
  /// Between two samples, 250 Hz: the rate at which PX4's own simulations run it.
  static constexpr Stamp kSample{std::chrono::milliseconds(4)};

  /// Waits for PX4 to connect. @pre validate(options), !is_board(options.hil)   Errors: those of HilLink::open().
  static Result<std::unique_ptr<Px4Exchange>> open(const Px4Options& options, std::uint64_t seed);

  /// Until its first motors it needs samples at the pace of the real world.
  Status begin(const QuadrotorState& held) override;
  Status meanwhile(const QuadrotorState& held, const std::function<Status()>& join) override;
  void advance(const QuadrotorState& state) noexcept override;
  void rest() noexcept override {}
  flight::LoopClock& clock() noexcept override { return clock_; }
  std::unique_ptr<firmware::Link> setpoint_link() override { return nullptr; }
  const firmware::HilMotors& motors() const noexcept override { return motors_; }
  const Eigen::Vector3d& specific_force_B() const noexcept override { return senses_.specific_force_B(); }
  const std::optional<Error>& broken() const noexcept override { return broken_; }

 private:
  Px4Lockstep(const Px4Options& options, std::uint64_t seed, std::unique_ptr<firmware::HilLink> hil);
  void keep_pace() noexcept;

  const double pace_;
  const std::unique_ptr<firmware::HilLink> hil_;
  Px4Senses senses_;
  SteppedClock clock_;
  firmware::HilMotors motors_;
  std::optional<Error> broken_;
  Stamp next_sample_{0}, paced_at_{0}, paced_wall_{0};
};

}  // namespace gatefield::simulator
