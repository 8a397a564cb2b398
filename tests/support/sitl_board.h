#pragma once

#include <atomic>
#include <memory>
#include <thread>

#include "client/firmware/betaflight_sitl/packets.h"
#include "client/firmware/link/link.h"
#include "tests/support/betaflight_controller.h"

namespace gatefield::test {

/// BetaflightController as a program of its own would be: MSP on a TCP port, states and channels in and motors out
/// over UDP, on a thread of its own in real time, or, where stamps of states advance, in their time. All ports are free
/// ones.
class SitlBoard {
 public:
  /// @param motors_port  of the simulator
  SitlBoard(std::uint16_t motors_port, firmware::betaflight_sitl::Wire wire);
  ~SitlBoard();
  SitlBoard(const SitlBoard&) = delete;
  SitlBoard& operator=(const SitlBoard&) = delete;

  std::uint16_t msp_port() const { return msp_port_; }
  std::uint16_t state_port() const { return states_->local_port(); }
  std::uint16_t channels_port() const { return channels_->local_port(); }
  /// As one without the clock library: it never runs in the states' time.
  void keep_own_clock() { own_clock_ = true; }

  /// From now on it does nothing any more, as a program that was stopped.
  void hang() { hangs_ = true; }
  bool armed() const { return armed_; }

 private:
  void run();
  void take_channels();

  const firmware::betaflight_sitl::Wire wire_;
  std::uint16_t msp_port_ = 0;
  std::unique_ptr<firmware::Link> states_, motors_, channels_;
  std::unique_ptr<BetaflightController> board_;
  Stamp time_{0};
  std::atomic<bool> stop_{false}, hangs_{false}, armed_{false}, own_clock_{false};
  std::thread thread_;
};

}  // namespace gatefield::test
