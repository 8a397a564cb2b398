#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <utility>

#include "common/base/clock.h"
#include "common/base/rate_limiter.h"
#include "common/dds/endpoint.h"

/// Inside common/dds only.
namespace gatefield::dds {

/// Tells of samples that were not taken, once a second at most.
/// Thread-safe: yes.   Allocates when it tells, not when it counts.
class SampleDrops {
 public:
  explicit SampleDrops(std::function<void(const DroppedSamples&)> tell) : tell_(std::move(tell)) {}

  void count(SampleFault fault, Topic topic, std::string_view vehicle, const ParticipantId& from) {
    unsigned untold = 0;
    if (!limiter_.admit(MonotonicClock().now(), &untold) || !tell_) return;
    tell_({untold + 1u, fault, topic, std::string(vehicle), from});
  }

 private:
  const std::function<void(const DroppedSamples&)> tell_;
  RateLimiter limiter_;
};

}  // namespace gatefield::dds
