#pragma once

#include <atomic>
#include <cstdint>
#include <string>
#include <thread>

#include "common/base/clock.h"
#include "tests/support/rate_controller.h"

namespace gatefield::test {

/// HilFirmware and its MavlinkController as a program of their own would be: on a thread, connected to a simulator over
/// TCP and to a bridge over UDP, in lockstep by the simulator's time.
class Px4Board {
 public:
  /// What it does, or stops to do, from the moment it is told.
  enum class Does : std::uint8_t { kFly, kHang, kDie, kDisarm, kLeaveMode, kSayNothing };

  /// It connects as soon as the simulator listens.
  /// @param simulator, bridge  ports of this machine
  Px4Board(std::uint16_t simulator, std::uint16_t bridge, const RateController::Options& loop = {});
  ~Px4Board();
  Px4Board(const Px4Board&) = delete;
  Px4Board& operator=(const Px4Board&) = delete;

  void from_now_on(Does what) { does_ = what; }
  /// It refuses to arm.
  void refuse_to_arm() { refuses_ = true; }
  bool armed() const { return armed_; }

 private:
  void run(std::uint16_t simulator, std::uint16_t bridge, const RateController::Options& loop);

  std::atomic<Does> does_{Does::kFly};
  std::atomic<bool> stop_{false}, refuses_{false}, armed_{false};
  std::thread thread_;
};

/// A port of this machine that is free now.
std::uint16_t free_port(const std::string& kind);

}  // namespace gatefield::test
