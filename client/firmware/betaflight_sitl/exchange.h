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
  std::uint16_t state_port = kStatePort, motors_port = kMotorsPort, channels_port = kChannelsPort;
  Wire wire = Wire::kUntil2025;
};

/// The simulator's side of Betaflight SITL: a state goes out each step of the plant, motors come in. It says how old
/// they are, so that a firmware that hangs is not flown on for ever.
///
/// Either by the machine's clock, exchange(); or in lockstep, begin_step() and end_step() in turn, in which the
/// firmware has the clock library (packets.h). One of both only.
/// Thread-safe: no.   Real-time safe: exchange() and send() yes (system calls, no allocation).
class Exchange {
 public:
  /// Errors: as open(), field "host" or "port": another simulator (or firmware) holds the port of the motors.
  static Result<std::unique_ptr<Exchange>> open(const ExchangeOptions& options, const Clock& clock);
  /// Gives a firmware in lockstep the machine's clock back.
  ~Exchange();
  Exchange(const Exchange&) = delete;
  Exchange& operator=(const Exchange&) = delete;

  /// Sends the state and takes what motors have come. @return the newest of all time; empty: none came yet
  std::optional<Motors> exchange(const State& state) noexcept;
  /// Sends the state and has the firmware run on for `span`, at the same time as whatever follows here.
  /// @pre 0 < span <= 0.1 s
  void begin_step(const State& state, std::chrono::nanoseconds span) noexcept;
  /// Waits for the motors at the end of the step, at most `limit` of the machine's clock.
  /// @return empty: none came. Before the first step there are none, and it does not wait.
  std::optional<Motors> end_step(std::chrono::nanoseconds limit) noexcept;
  /// Pulses of its receiver, from 4.5 on; earlier ones don't listen. In lockstep they count from the next step on.
  /// @return false: the link took nothing
  bool send(const Channels& channels) noexcept;
  /// Since motors came last, or since the beginning.
  std::chrono::nanoseconds silent_for() const noexcept { return clock_.now() - heard_; }
  /// Waits for something to come, so that a simulator that waits for its firmware burns no time.
  bool wait(std::chrono::nanoseconds timeout) noexcept { return motors_link_->wait(timeout); }

  std::uint64_t sent() const noexcept { return sent_; }
  std::uint64_t received() const noexcept { return received_; }
  std::uint64_t malformed() const noexcept { return malformed_; }  ///< packets that were no motors
  /// What to say of a firmware that has been silent for too long, or has no clock library in lockstep (motors came, but
  /// without a stamp): kNotAnswering, with what to look at.
  Error silence() const;

 private:
  static constexpr double kBegin_s = 100.0;  // unlike a constant stamp

  Exchange(std::unique_ptr<Link> state_link, std::unique_ptr<Link> motors_link, std::unique_ptr<Link> channels_link,
           Wire wire, const Clock& clock);
  std::optional<Motors> hear_stamped() noexcept;
  double stamp_s() const noexcept { return kBegin_s + seconds(time_); }

  const std::unique_ptr<Link> state_link_, motors_link_, channels_link_;
  const Wire wire_;
  const Clock& clock_;
  Stamp heard_;
  std::optional<Motors> motors_;
  std::uint64_t sent_ = 0, received_ = 0, malformed_ = 0, plain_ = 0, stamped_ = 0;
  std::chrono::nanoseconds time_{0};  // of lockstep, since kBegin_s
};

}  // namespace gatefield::firmware::betaflight_sitl
