#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <string>
#include <thread>

#include "client/flight/arming_checks.h"
#include "client/flight/loop.h"
#include "client/flight/supervisor.h"
#include "common/base/mailbox.h"
#include "gatefield/sdk/client.h"

namespace gatefield::bridge {

/// Watches a supervised flight, tells a person of it, and says when it is over: what the supervisor enters and why,
/// which checks before arming fail, which gate is next, what the server finds wrong, what becomes of the session, and
/// at the end how the vehicle followed what it was asked for. The loop's thread only leaves notes; a thread of this
/// class's own writes them to the log.
///
/// The flight is over when the vehicle was in the air and is disarmed again, and when nothing was heard of the flight
/// controller for kLinkLost on the ground (in the air that is the supervisor's affair).
/// Thread-safe: the Observer's part on the loop's thread, the rest before and after the loop.   Real-time safe: the
/// Observer's part, yes.
class FlightLog final : public flight::Observer {
 public:
  static constexpr Stamp kLinkLost{std::chrono::seconds(5)};

  /// @param told  how the vehicle is driven, as the session was told   @param period  of the loop
  /// @param client  outlives this
  FlightLog(const flight::SupervisorOptions& options, const Actuation& told, Stamp period, sdk::Client* client);
  ~FlightLog() override;
  FlightLog(const FlightLog&) = delete;
  FlightLog& operator=(const FlightLog&) = delete;

  void on_plan(const protocol::ThrustRateCommand& plan) noexcept override;
  void on_phase(const flight::Directive& directive) noexcept override;
  void on_supervised(const flight::Directive& directive, const flight::Observation& observation) noexcept override;
  bool goes_on() noexcept override;

  /// The flight ended, or could not begin, because nothing was heard of the flight controller.
  bool link_lost() const noexcept { return link_lost_; }

 private:
  struct Moment {
    flight::Directive directive;
    flight::Observation observation;
  };

  void write_until_the_end();
  void write();
  void write_phases();
  void write_checks();
  void write_gates();
  void write_problems();
  void write_session();
  void write_found();

  static constexpr std::size_t kKept = 64;  // phases that wait to be written; more at once are not told

  const flight::SupervisorOptions options_;
  const Actuation told_;
  const Stamp period_;
  sdk::Client& client_;

  // the loop's thread
  flight::Phase phase_ = flight::Phase::kDisarmed;
  bool flown_ = false, link_lost_ = false;
  Stamp silent_{0};

  // Between the two. Phases are a ring with one writer and one reader: each slot is the writer's until entered_ counts
  // it (release), the reader's until written_ does.
  std::array<flight::Directive, kKept> phases_;
  std::atomic<std::size_t> entered_{0}, written_{0};
  Mailbox<Moment> moment_;
  std::atomic<std::uint64_t> passages_{0};  // lap and waypoint that is next, each in half of it

  // the writer's thread
  flight::Checks told_checks_ = 0;
  std::uint64_t told_passages_ = 0;
  std::atomic<bool> ending_{false};
  std::thread writer_;
};

}  // namespace gatefield::bridge
