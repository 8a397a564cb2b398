#include "common/dds/library_log.h"

#include <fastdds/dds/log/Log.hpp>
#include <iostream>
#include <memory>
#include <mutex>
#include <utility>

#include "common/base/clock.h"
#include "common/base/rate_limiter.h"
#include "common/base/text.h"

namespace gatefield::dds {
namespace {

using eprosima::fastdds::dds::Log;

constexpr std::size_t kLongestLine = 500;

class Sink {
 public:
  void set(std::function<void(const std::string&)> sink) {
    const std::lock_guard lock(mutex_);
    sink_ = std::move(sink);
  }
  void say(const Log::Entry& entry) {
    unsigned held = 0;
    if (!limiter_.admit(MonotonicClock().now(), &held)) return;
    const std::string others = held > 0 ? " (and " + std::to_string(held) + " other lines)" : "";
    const std::lock_guard lock(mutex_);
    if (sink_) sink_("the DDS library says: " + shown(entry.message, kLongestLine) + others);
  }

 private:
  RateLimiter limiter_;
  std::mutex mutex_;
  std::function<void(const std::string&)> sink_ = [](const std::string& line) { std::cerr << line << '\n'; };
};

/// Lives as long as the library's thread may call it.
Sink& only_sink() {
  static auto* const only = new Sink;
  return *only;
}

class Consumer final : public eprosima::fastdds::dds::LogConsumer {
 public:
  void Consume(const Log::Entry& entry) override { only_sink().say(entry); }
};

}  // namespace

void set_library_log(std::function<void(const std::string& line)> sink) { only_sink().set(std::move(sink)); }

void limit_library_log() {
  Log::ClearConsumers();
  Log::RegisterConsumer(std::make_unique<Consumer>());
}

}  // namespace gatefield::dds
