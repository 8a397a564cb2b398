#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "common/base/result.h"
#include "common/protocol/messages.h"

namespace gatefield::sdk {

struct Options {
  std::uint32_t domain = 0;       ///< DDS domain, 0 to 232
  std::string vehicle = "drone";  ///< name on the wire; one client per name
  std::string server;             ///< only this one may answer; empty = whichever is first
  std::string profile = "race";   ///< planner profile of the server
  protocol::Timing timing = protocol::Timing::kRealTime;
  std::uint64_t seed = 1;
  double speed_limit_m_s = 0.0;  ///< 0 = the profile's
  QuadrotorModel quadrotor;
  CameraModel camera = default_camera();
  Course course;
  std::chrono::milliseconds connect_timeout{5000};
};

/// What to do right now, from the plan or from the fallback.
struct Setpoint {
  enum class Source { kPlan, kFallback };
  Source source = Source::kFallback;
  Eigen::Vector4d thrust_rate_n_s = Eigen::Vector4d::Zero();  ///< per rotor
  Eigen::Vector4d rotor_thrust_n =
      Eigen::Vector4d::Zero();       ///< commanded thrust at `now`, for clients that take thrusts
  double collective_thrust_n = 0.0;  ///< for clients that take collective thrust and body rates
  Eigen::Vector3d body_rates_rad_s = Eigen::Vector3d::Zero();  ///< FLU
};

struct LinkStatistics {
  std::uint64_t commands = 0;     ///< received and accepted
  std::uint64_t rejected = 0;     ///< failed validation or of another session
  std::uint64_t reconnects = 0;   ///< sessions adopted after the first
  double round_trip_p50_s = 0.0;  ///< state sent to command received, by the client's clock; of the last 4096
  double round_trip_p99_s = 0.0;
  double solve_p50_s = 0.0;
  double solve_p99_s = 0.0;
};

/// The thin client: joins a session, sends state and depth, holds the newest plan, plays it out, and falls back by
/// itself when the plan runs dry (level out, hold height, then descend). A server that dies and returns is joined again
/// without a call. Thread-safe: send_*, newest, play and statistics may be called from different threads. Real-time
/// safe: play() yes; the others make system calls.
class Client {
 public:
  /// Blocks until a server accepts, refuses (its sentence is the error) or the timeout passes.
  static Result<std::unique_ptr<Client>> connect(const Options& options);
  virtual ~Client() = default;  ///< leaves the session

  /// The accepted session: control period, plan step, model hash.
  virtual protocol::SessionReply session() const = 0;

  /// @param stamp   client's monotonic clock (or simulated time), the same clock in every call
  /// @param depth_m row-major, width * height of options.camera, 0 = no return
  /// @return the frame's sequence number
  virtual std::uint64_t send_depth(Stamp stamp, std::span<const float> depth_m) = 0;
  virtual std::uint64_t send_depth_mm(Stamp stamp, std::span<const std::uint16_t> depth_mm) = 0;
  /// @return the state's sequence number
  virtual std::uint64_t send_state(Stamp stamp, const QuadrotorState& state, bool thrust_known = true) = 0;

  /// The newest command, once; empty when there is no newer one than last time.
  virtual std::optional<protocol::ThrustRateCommand> newest() = 0;
  /// Lockstep: waits for the command that answers this state (sent again meanwhile, since states are best effort).
  virtual std::optional<protocol::ThrustRateCommand> wait_for_answer(std::uint64_t state_sequence,
                                                                     std::chrono::milliseconds timeout) = 0;

  /// What to apply now: the plan at `now`, or the fallback when it has run out. `state` feeds the fallback.
  virtual Setpoint play(Stamp now, const QuadrotorState& state) = 0;

  virtual LinkStatistics statistics() const = 0;
  /// The newest telemetry, if any came since last time.
  virtual std::optional<protocol::Telemetry> telemetry() = 0;
};

}  // namespace gatefield::sdk
