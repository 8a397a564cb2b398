#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>

#include "common/base/clock.h"
#include "common/protocol/messages.h"
#include "server/perception/sight.h"
#include "server/pilot/mailboxes.h"

namespace gatefield::pilot {

/// The perception side of a pilot: from a depth frame to what is remembered of the gates.
/// Thread-safe: due() yes; the rest by one thread at a time.   Real-time safe: no.
class Looking {
 public:
  /// @param request  of the session; @param shared  both outlive this
  Looking(const protocol::SessionRequest* request, std::unique_ptr<perception::GateSensor> sensor,
          const perception::SightOptions& options, Mailboxes* shared);

  /// There is a frame to look at now. Lockstep: not before a state named it, because that state's pose is what the
  /// frame is bound to.
  bool due() const noexcept;
  /// Looks at the newest frame. @return false when there was none. Never throws: a sensor that does costs its frame.
  bool look() noexcept;
  /// How long the newest look() took, for telemetry.
  void looked(std::chrono::nanoseconds took) noexcept {
    shared_->account.encode_time_ns.store(took.count(), std::memory_order_relaxed);
  }
  /// Processor time of a look(), by whoever measures it.
  void spent(std::chrono::nanoseconds cpu) noexcept {
    shared_->account.look_cpu_ns.fetch_add(cpu.count(), std::memory_order_relaxed);
    Account::count(shared_->account.frames_looked_at);
  }

  /// Hands what is remembered of the waypoints' gates to the control side. @param frame  that was looked at last
  void publish(const Targets& targets, std::uint64_t frame) noexcept;

  perception::Sight& sight() noexcept { return sight_; }
  /// Capture of the newest frame that was looked at; negative: none was.
  Stamp newest_capture() const noexcept { return newest_capture_; }
  /// Number of the states' time line that the remembered gates' stamps are of.
  std::uint32_t line() const noexcept { return line_; }
  void restore(Stamp newest_capture, std::uint32_t line, std::uint32_t frames_line) noexcept {
    newest_capture_ = newest_capture;
    line_ = line;
    frames_line_.store(frames_line, std::memory_order_relaxed);
  }

 private:
  void look_at(const DepthSample& frame, const Targets& targets);
  void begin_line(Stamp capture);
  /// Whether a frame has no pose only because it is one of the session's first: captured shortly before the first
  /// state, or sent before it. Every client begins so, and nothing is wrong.
  /// @param off  StateHistory::pose_at()'s
  bool begins_before_states(StateHistory::Found found, std::chrono::nanoseconds off) const noexcept;
  bool lockstep() const noexcept { return request_->timing == protocol::Timing::kLockstep; }

  const protocol::SessionRequest* request_;
  Mailboxes* shared_;
  perception::Sight sight_;
  Stamp newest_capture_{-1};
  std::uint32_t line_ = 0;
  std::atomic<std::uint32_t> frames_line_{0};  // of the newest frame that was looked at
};

}  // namespace gatefield::pilot
