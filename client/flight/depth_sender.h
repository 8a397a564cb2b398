#pragma once

#include <atomic>
#include <cstdint>
#include <thread>

#include "client/flight/ports.h"

namespace gatefield::flight {

/// Sends depth frames on a thread of its own, so that a slow frame never holds up the loop.
/// Thread-safe: no (one owner).
class DepthSender {
 public:
  /// @param source  null: a vehicle without a camera, nothing is sent
  DepthSender(DepthSource* source, sdk::Client* client);
  ~DepthSender() { stop(); }
  DepthSender(const DepthSender&) = delete;
  DepthSender& operator=(const DepthSender&) = delete;

  /// Ends the thread: within kWait and the time that a frame takes. @return how many frames were sent
  std::uint64_t stop();

 private:
  static constexpr std::chrono::milliseconds kWait{50};
  void run();

  DepthSource* source_;
  sdk::Client& client_;
  std::atomic<bool> ending_{false};
  std::uint64_t sent_ = 0;  // the thread's until it is joined
  std::thread thread_;      // last: the others are there before it runs
};

}  // namespace gatefield::flight
