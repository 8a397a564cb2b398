#pragma once

#include <csignal>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "client/firmware/betaflight_sitl/packets.h"
#include "common/base/child_process.h"

namespace gatefield::test {

/// The settings that the bridge asks for, and rates of one type, for a command line.
std::vector<std::string> bridge_settings(const std::string& type, int rc_rate, int super_rate, int expo);

/// The settings beside them with which docs/flight-controllers.md has it fly the shipped racer.
std::vector<std::string> racer_settings();

/// A real Betaflight of the target SITL, in a folder of its own, set up over its command line.
class RealFirmware {
 public:
  /// The program that GATEFIELD_BETAFLIGHT_SITL names; empty: none.
  static std::string program();
  /// What GATEFIELD_BETAFLIGHT_WIRE says: "until2025" (unless told) or "since2026".
  static firmware::betaflight_sitl::Wire wire();

  /// Starts it, types `settings` into its command line, saves, and starts it again. Aborts the test when that fails.
  /// @param clock  a library that gives it the simulator's time; empty: it has its own
  RealFirmware(const std::filesystem::path& folder, const std::vector<std::string>& settings, std::string clock = "");

  void stop() { process_->signal(SIGSTOP); }
  void go_on() { process_->signal(SIGCONT); }

 private:
  void start();

  const std::filesystem::path folder_;
  const std::string clock_;
  std::unique_ptr<ChildProcess> process_;
};

}  // namespace gatefield::test
