#pragma once

#include <chrono>
#include <cstdint>

namespace gatefield {

/// A point on one machine's monotonic clock (or on simulated time), since that clock's own epoch.
/// Stamps of different machines are never subtracted from each other.
using Stamp = std::chrono::nanoseconds;

inline double seconds(std::chrono::nanoseconds span) noexcept { return std::chrono::duration<double>(span).count(); }
inline std::chrono::nanoseconds from_seconds(double span_s) noexcept {
  return std::chrono::nanoseconds(static_cast<std::int64_t>(span_s * 1e9 + (span_s < 0 ? -0.5 : 0.5)));
}

/// Where the present comes from; tests and lockstep put their own in.
class Clock {
 public:
  virtual ~Clock() = default;
  virtual Stamp now() const noexcept = 0;
};

class MonotonicClock final : public Clock {
 public:
  Stamp now() const noexcept override { return std::chrono::steady_clock::now().time_since_epoch(); }
};

class ManualClock final : public Clock {
 public:
  Stamp now() const noexcept override { return now_; }
  void set(Stamp now) noexcept { now_ = now; }
  void advance(std::chrono::nanoseconds span) noexcept { now_ += span; }

 private:
  Stamp now_{0};
};

}  // namespace gatefield
