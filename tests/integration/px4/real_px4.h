#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "common/base/child_process.h"
#include "common/vehicle/quadrotor.h"

namespace gatefield::test {

/// What the vehicle and the loop need, as lines for PX4's shell: layout of the rotors, gains for its rate loop, and no
/// failsafe for what the loop does not have (radio, ground station). docs/flight-controllers.md has those of the racer.
std::vector<std::string> px4_settings(const QuadrotorModel& model);

/// A real PX4 of the target SITL, in a folder of its own.
class RealPx4 {
 public:
  /// The program that GATEFIELD_PX4_SITL names (bin/px4 of its build); empty: none.
  static std::string program();

  /// Starts it; it looks for its simulator. Aborts the test when it can't be started.
  RealPx4(const std::filesystem::path& folder, const std::vector<std::string>& settings);

  /// As a program that hangs, and one that died.
  void stop();
  void kill();

 private:
  std::unique_ptr<ChildProcess> process_;
};

}  // namespace gatefield::test
