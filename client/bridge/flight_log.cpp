#include "client/bridge/flight_log.h"

#include <chrono>

#include "common/base/logging.h"
#include "common/base/text.h"
#include "common/protocol/problems.h"

namespace gatefield::bridge {
namespace {

using namespace std::chrono_literals;

constexpr auto kEvery = 50ms;

}  // namespace

FlightLog::FlightLog(const flight::SupervisorOptions& options, const Actuation& told, Stamp period, sdk::Client* client)
    : options_(options), told_(told), period_(period), client_(*client), writer_([this] { write_until_the_end(); }) {}

FlightLog::~FlightLog() {
  ending_ = true;
  writer_.join();
}

void FlightLog::on_plan(const protocol::ThrustRateCommand& plan) noexcept {
  passages_.store(std::uint64_t{plan.health.lap} << 32 | plan.health.target_waypoint, std::memory_order_relaxed);
}

void FlightLog::on_phase(const flight::Directive& directive) noexcept {
  const std::size_t entered = entered_.load(std::memory_order_relaxed);
  if (entered - written_.load(std::memory_order_acquire) == kKept) return;
  phases_[entered % kKept] = directive;
  entered_.store(entered + 1, std::memory_order_release);
}

void FlightLog::on_supervised(const flight::Directive& directive, const flight::Observation& observation) noexcept {
  moment_.write({directive, observation});
  phase_ = directive.phase;
  const bool in_the_air = flight::contains(flight::kInTheAir, phase_);
  flown_ = flown_ || in_the_air;
  const bool silent = (directive.failing & flight::bit(flight::Check::kControllerHeard)) != 0;
  if (flown_) {
    // One that dies takes its states with it, which are missed first.
    link_lost_ = link_lost_ || directive.cause == flight::Cause::kControllerSilent ||
                 (phase_ == flight::Phase::kKilled && silent);
    return;
  }
  silent_ = silent ? silent_ + period_ : Stamp{0};
  link_lost_ = silent_ >= kLinkLost;
}

bool FlightLog::goes_on() noexcept {
  const bool down = phase_ == flight::Phase::kDisarmed || phase_ == flight::Phase::kReady;
  return !(down && (flown_ || link_lost_));
}

void FlightLog::write_until_the_end() {
  while (!ending_) {
    write();
    std::this_thread::sleep_for(kEvery);
  }
  write();
  write_found();
}

void FlightLog::write() {
  write_checks();
  write_phases();
  write_gates();
  write_problems();
  write_session();
}

void FlightLog::write_phases() {
  for (std::size_t written = written_; written != entered_.load(std::memory_order_acquire); ++written) {
    const flight::Directive& directive = phases_[written % kKept];
    log::info(std::string(name(directive.phase)) + " (" + std::string(sentence(directive.phase)) +
              "): " + std::string(name(directive.cause)) + ", " + std::string(sentence(directive.cause)));
    written_.store(written + 1, std::memory_order_release);
  }
}

void FlightLog::write_checks() {
  const Moment* moment = moment_.read();
  if (moment == nullptr || moment->directive.phase != flight::Phase::kDisarmed) return;
  for (const flight::Check check : flight::list(moment->directive.failing & ~told_checks_))
    log::warn("not ready: " + flight::explain(check, moment->observation, options_).message);
  told_checks_ = moment->directive.failing;
}

void FlightLog::write_gates() {
  const std::uint64_t passages = passages_.load(std::memory_order_relaxed);
  if (passages == told_passages_) return;
  told_passages_ = passages;
  log::info("next: gate " + text((passages & UINT32_MAX) + 1) + " of lap " + text((passages >> 32) + 1));
}

void FlightLog::write_problems() {
  while (const auto change = client_.problem_change()) {
    const std::string words =
        std::string(protocol::name(change->problem)) + ", " + std::string(protocol::sentence(change->problem));
    if (change->began)
      log::warn("the server says: " + words);
    else
      log::info("the server no longer says: " + words);
  }
}

void FlightLog::write_session() {
  while (const auto change = client_.session_change()) log::warn(change->sentence);
}

void FlightLog::write_found() {
  const auto telemetry = client_.telemetry();
  if (!telemetry) return;
  const std::string found = protocol::in_words(telemetry->identified, told_);
  if (!found.empty()) log::info("found in flight: " + found);
}

}  // namespace gatefield::bridge
