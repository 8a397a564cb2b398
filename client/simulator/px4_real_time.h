#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "client/firmware/link/shared_link.h"
#include "client/firmware/px4_hil/hil_board.h"
#include "client/simulator/px4_exchange.h"
#include "client/simulator/px4_options.h"
#include "client/simulator/px4_senses.h"

namespace gatefield::simulator {

/// A board by its own clock, and the plant by the machine's. Samples go out by the machine's clock at their rate, each
/// of the newest state; the newest motors are taken up with every step. A plant that is late and makes up for it in
/// short steps sends no more samples for that.
///
/// One port carries sensors and motors, and setpoints and status beside them, where they don't go another way.
/// Thread-safe: no.   Real-time safe: advance() (system calls; allocation for what ends the flight); the rest no.
class Px4RealTime final : public Px4Exchange {
 public:
  /// Opens the port. @pre validate(options), is_board(options.hil)   Errors: those of firmware::open().
  static Result<std::unique_ptr<Px4Exchange>> open(const Px4Options& options, std::uint64_t seed);

  /// Errors: those of HilBoard::connect().
  Status begin(const QuadrotorState& held) override;
  Status meanwhile(const QuadrotorState& held, const std::function<Status()>& join) override;
  void advance(const QuadrotorState& state) noexcept override;
  void rest() noexcept override;
  flight::LoopClock& clock() noexcept override { return clock_; }
  std::unique_ptr<firmware::Link> setpoint_link() override { return link_.taker(); }
  const firmware::HilMotors& motors() const noexcept override { return motors_; }
  const Eigen::Vector3d& specific_force_B() const noexcept override { return senses_.specific_force_B(); }
  const std::optional<Error>& broken() const noexcept override { return broken_; }

 private:
  Px4RealTime(const Px4Options& options, std::uint64_t seed, std::unique_ptr<firmware::Link> link);
  Status exchange(const QuadrotorState& state);

  flight::RealTimeClock clock_;
  firmware::SharedLink link_;
  firmware::HilBoard board_;
  Px4Senses senses_;
  const Stamp sample_period_;
  firmware::HilMotors motors_;
  std::optional<Error> broken_;
  Stamp simulated_{0}, next_sample_{0};
};

}  // namespace gatefield::simulator
