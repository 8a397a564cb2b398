#pragma once

#include <functional>
#include <map>
#include <set>
#include <string>

#include "client/simulator/simulation.h"
#include "tests/integration/faults/falsifying_client.h"

namespace gatefield::test {

/// What is wrong with a flight's client, and when the flight may end.
struct Fault {
  std::function<void(sdk::Options*)> told;  ///< vehicle and camera as the server is told; empty: as they are
  Falsification falsification;              ///< of what is sent in flight
  bool depth_in_counts = true;
  /// The flight ends kFlownOn_s after all of them were heard: what is told wrongly is told by then. Empty: it ends by
  /// itself.
  std::set<protocol::Problem> until_heard;
  protocol::Timing timing = protocol::Timing::kLockstep;
  bool one_gate = false;  ///< one gate straight ahead, where it should be, is flown through; else a lap of the circle
};
constexpr double kFlownOn_s = 0.5;

struct Flown {
  simulator::Report report;
  std::map<protocol::Problem, double> heard_s;  ///< race time when each problem was heard of first
  double moving_s = 0.0;                        ///< race time when the vehicle first was faster than 0.3 m/s

  /// "states_look_ned at 0.48 s, ...", and the result.
  std::string story() const;
};

/// Flies a lap of the circle with gates 0.3 m off, or another course, with the server of this process's DDS domain.
Flown fly_with(const Fault& fault);

}  // namespace gatefield::test
