#pragma once

#include <atomic>
#include <memory>
#include <string>
#include <thread>

#include "common/base/clock.h"
#include "tests/support/rate_controller.h"
#include "tests/support/terminal.h"

namespace gatefield::test {

/// HilFirmware and its MavlinkController as a board with PX4 on a serial port would be: on a thread, by its own clock,
/// sensors, motors, setpoints and status on one pseudo terminal.
class SerialBoard {
 public:
  struct Options {
    RateController::Options loop;
    bool hil = true;             ///< it is in HIL mode
    bool thrust_linear = false;  ///< THR_MDL_FAC is 1
    LineNoise noise;             ///< of the line, from the board to us
  };
  /// What it does, or stops to do, from the moment it is told.
  enum class Does : std::uint8_t {
    kFly,
    kHang,
    kComeOff,  ///< its cable is pulled
    kDisarm,
  };

  explicit SerialBoard(Options options);
  ~SerialBoard();
  SerialBoard(const SerialBoard&) = delete;
  SerialBoard& operator=(const SerialBoard&) = delete;

  /// Of the port at our end, 921600 baud.
  const std::string& address() const { return address_; }

  void from_now_on(Does what) { does_ = what; }
  bool armed() const { return armed_; }
  std::uint64_t samples() const { return samples_; }
  std::uint64_t truths() const { return truths_; }

 private:
  void run(std::unique_ptr<Terminal> terminal);

  const Options options_;
  std::string address_;
  std::atomic<Does> does_{Does::kFly};
  std::atomic<bool> stop_{false}, armed_{false};
  std::atomic<std::uint64_t> samples_{0}, truths_{0};
  std::thread thread_;
};

}  // namespace gatefield::test
