// Flies a simulated quadrotor that has a flight controller through a gate that stands 0.3 m beside where the server was
// told: collective thrust and body rates are what it is commanded.
//   gatefield-rates [DDS domain, 0 unless told] [turns of the loop per second, 100] [lockstep or realtime, lockstep]
// Exit code: 0 passed, 1 no server, 2 not passed.
#include <gatefield/sdk/client.h>

#include <cstdio>
#include <cstdlib>
#include <string>

#include "fly.h"
#include "vehicle.h"

int main(int argc, char** argv) {
  const bool lockstep = argc <= 3 || std::string(argv[3]) != "realtime";
  const int rate_hz = argc > 2 ? std::atoi(argv[2]) : 100;

  gatefield::sdk::Options options;
  options.domain = argc > 1 ? static_cast<std::uint32_t>(std::atoi(argv[1])) : 0;
  options.vehicle = "rates";
  options.timing = lockstep ? gatefield::protocol::Timing::kLockstep : gatefield::protocol::Timing::kRealTime;
  options.speed_limit_m_s = 5.0;
  options.actuation = RateControlledVehicle::actuation(options.quadrotor);
  options.course.waypoints = {{{8, 0, 1.5}, {1, 0, 0}}};  // about where the gate is, and the passing direction
  options.course.closed = false;

  auto connected = gatefield::sdk::Client::connect(options);
  if (!connected) {
    std::fprintf(stderr, "%s\n", connected.error().c_str());
    return 1;
  }
  const gatefield::GateShape gate;
  RateControlledVehicle vehicle(options.quadrotor, options.camera, gate, {8, 0.25, 1.35}, !lockstep);
  fly_by_rates(**connected, vehicle, gatefield::from_seconds(1.0 / rate_hz), lockstep);

  const Eigen::Vector3d p_W = vehicle.truth().p_WB;
  std::printf("%s after %.1f s at %.2f %.2f %.2f\n", vehicle.passed() ? "passed" : "not passed", vehicle.flown_s(),
              p_W.x(), p_W.y(), p_W.z());
  std::printf("latest turn %.0f ms late\n", 1e3 * vehicle.latest_s());
  return vehicle.passed() ? 0 : 2;
}
