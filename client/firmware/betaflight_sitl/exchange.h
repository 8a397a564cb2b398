#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <string>

#include "client/firmware/betaflight_sitl/packets.h"
#include "client/firmware/link/link.h"
#include "common/base/clock.h"
#include "common/base/result.h"

namespace gatefield::firmware::betaflight_sitl {

struct ExchangeOptions {
  std::string host = "127.0.0.1";  ///< where the firmware runs
  std::uint16_t state_port = kStatePort, motors_port = kMotorsPort;
  Wire wire = Wire::kUntil2025;
};

/// The simulator's side of Betaflight SITL: a state goes out each step of the plant, the newest motors come in. It says
/// how old they are, so that a firmware that hangs is not flown on for ever.
/// Thread-safe: no.   Real-time safe: exchange() yes (system calls, no allocation).
class Exchange {
 public:
  /// Errors: as open(), field "host" or "port": another simulator (or firmware) holds the port of the motors.
  static Result<std::unique_ptr<Exchange>> open(const ExchangeOptions& options, const Clock& clock);

  /// Sends the state and takes what motors have come. @return the newest of all time; empty: none came yet
  std::optional<Motors> exchange(const State& state) noexcept;
  /// Since motors came last, or since the beginning.
  std::chrono::nanoseconds silent_for() const noexcept { return clock_.now() - heard_; }
  /// Waits for something to come, so that a simulator that waits for its firmware burns no time.
  bool wait(std::chrono::nanoseconds timeout) noexcept { return motors_link_->wait(timeout); }

  std::uint64_t sent() const noexcept { return sent_; }
  std::uint64_t received() const noexcept { return received_; }
  std::uint64_t malformed() const noexcept { return malformed_; }  ///< packets that were no motors
  /// What to say of a firmware that has been silent for too long: kNotAnswering, with what to look at.
  Error silence() const;

 private:
  Exchange(std::unique_ptr<Link> state_link, std::unique_ptr<Link> motors_link, Wire wire, const Clock& clock);

  const std::unique_ptr<Link> state_link_, motors_link_;
  const Wire wire_;
  const Clock& clock_;
  Stamp heard_;
  std::optional<Motors> motors_;
  std::uint64_t sent_ = 0, received_ = 0, malformed_ = 0;
};

}  // namespace gatefield::firmware::betaflight_sitl
