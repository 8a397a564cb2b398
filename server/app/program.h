#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/dds/network.h"
#include "common/protocol/messages.h"
#include "server/app/trace.h"
#include "server/kernels/backend.h"
#include "server/perception/gate_sensor.h"

namespace CLI {
class App;
}

/// What every program that serves vehicles has in common: its options, its signals, its way into the DDS domain and
/// out of it. A program is this and what it sees with.
namespace gatefield::app {

inline constexpr int kBadInput = 2;   ///< exit code: arguments, model or configuration
inline constexpr int kNotJoined = 3;  ///< exit code: the middleware refuses
inline constexpr int kDeaf = 4;       ///< exit code: shared memory no longer brings anything; start again

/// What a user may say on the command line; what stands here before add_options() is the default that --help tells.
struct Options {
  std::string profiles;
  std::string shown_profile;  ///< name of the one to print, and nothing else; empty: serve
  std::uint32_t domain = 0;
  std::string name = "gatefield";
  std::string standby, standby_of;  ///< names of other servers: who goes on after this one, whom this one goes on after
  int threads = 0;
  int perception_threads = 1;
  int max_vehicles = 8;
  double utilisation = 0.75;
  int max_priority = protocol::kUsualPriority;
  std::string isa = "auto";
  std::string log_level = "info";
  std::string log_format = "text";
  std::string metrics;
  bool realtime = false;
  std::vector<int> cores;
  dds::NetworkOptions network;
  std::uint16_t discovery_port = 0;  ///< of a discovery server of its own; 0: none
  TraceOptions trace;
};
void add_options(CLI::App* app, Options* options);

/// What a program sees with.
struct Eyes {
  std::string words;                  ///< for the log, such as "model race"
  std::vector<std::string> warnings;  ///< for the log
  std::uint64_t model_hash = 0;       ///< told to vehicles, and written into saved pilots
  double cone_angle_rad = 0.0;        ///< of the hourglass that fields have
  bool blind = false;  ///< never sees a gate, so that slowing down before one that was not seen gains nothing
  /// The error is what the vehicle is refused with: gates that can't be seen, for one.
  std::function<Result<std::unique_ptr<perception::GateSensor>>(const protocol::SessionRequest&)> sensor;
};

/// Serves until SIGINT or SIGTERM; SIGHUP reads the profiles again, and after SIGUSR1 it ends with its last vehicle.
/// @param open_eyes  called once the log is there and the kernels' back end is chosen
/// @return the exit code; what went wrong was told on standard error
int serve(const std::string& program, const Options& options,
          const std::function<Result<Eyes>(const kernels::Backend&)>& open_eyes);

/// Parses the command line and runs the body; what nobody expected is told, too. @return the exit code
int run_program(CLI::App* app, int argc, char** argv, const std::function<int()>& body);

}  // namespace gatefield::app
