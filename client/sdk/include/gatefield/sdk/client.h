#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "common/base/result.h"
#include "common/dds/network.h"
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
  /// 0 to 9: who has least is refused, or sent away, first when the server can't serve all. A server may take more than
  /// the usual for the usual.
  std::uint8_t priority = protocol::kUsualPriority;
  QuadrotorModel quadrotor;
  Actuation actuation;  ///< how the vehicle is driven; a server that doesn't plan for it refuses
  CameraModel camera = default_camera();
  Course course;
  std::chrono::milliseconds connect_timeout{5000};
  dds::NetworkOptions network;  ///< peers, interfaces, discovery servers; empty: multicast on all
};

/// What to do from `now` to `now + period`, as play() was asked, by the plan or by the fallback.
///
/// Actuation::Kind::kRotorThrusts: a vehicle takes one of the two ways to say it. Thrusts (and with them collective
/// thrust and body rates) are values that the plan reaches at now + period: hold them from `now` on until then. A plan
/// starts from what the rotors were asked for before, so the value at `now` itself is what they have already; held and
/// reported back, it would keep them where they are for ever.
///
/// Actuation::Kind::kBodyRates: collective thrust and body rates are commands for the flight controller, that hold from
/// `now` on (within a step of the plan they stay as they are, SessionReply::plan_step_s); the rotors' part is 0. The
/// planner has reckoned with the lags that Options::actuation tells: send them on as they are, and at once.
///
/// The fallback's thrusts and rates are what its law asks for at `now`, to be held as long.
struct Setpoint {
  enum class Source { kPlan, kFallback };
  Source source = Source::kFallback;
  /// Rotors that take a rate of thrust: dT/dt per rotor that holds at `now`, until the plan's step ends
  /// (SessionReply::plan_step_s). Ask several times in a step, at 200 Hz or more.
  PlainVector4 thrust_rate_n_s = PlainVector4::Zero();
  /// Rotors that take thrusts: each one's, and what QuadrotorState::thrust_command_n is from now on.
  PlainVector4 rotor_thrust_n = PlainVector4::Zero();
  double collective_thrust_n = 0.0;                            ///< of all rotors together, along +z of B
  Eigen::Vector3d body_rates_rad_s = Eigen::Vector3d::Zero();  ///< w_WB_B, about x, y, z of B (FLU)
};

struct LinkStatistics {
  std::uint64_t commands = 0;    ///< received and accepted
  std::uint64_t rejected = 0;    ///< failed validation, or of another session or participant
  std::uint64_t reconnects = 0;  ///< sessions adopted after the first
  std::uint64_t take_overs = 0;  ///< times that a stand-by went on with a session
  /// From the network, that the DDS library must not read; the last second's may not be counted yet.
  std::uint64_t packets_dropped = 0;
  double round_trip_p50_s = 0.0;  ///< state sent to command received, by the client's clock; of the last 4096
  double round_trip_p99_s = 0.0;
  double longest_silence_s = 0.0;  ///< longest time from a state to the next command, whoever it came from
  double solve_p50_s = 0.0;        ///< the server's step that made the plan, as it says; of the last 4096
  double solve_p99_s = 0.0;
};

/// Something that the server found wrong (or no longer), as this client heard it. protocol::name() and
/// protocol::sentence() say it in words.
struct ProblemChange {
  protocol::Problem problem{};
  bool began = false;  ///< false: it ended
};

/// What became of the session without this program's doing, as this client found it.
struct SessionChange {
  enum class Kind {
    kLost,       ///< there is none: the fallback flies, and the client asks for another one by itself
    kRejoined,   ///< there is one again: another one, or the same, whose server is heard again
    kTakenOver,  ///< the same one goes on, flown by another server
  };
  Kind kind = Kind::kLost;
  /// Why a session was lost, or left by the server before. As the server said: kBusyServer, it sends the vehicle away
  /// (overload, or one of higher priority needs the place); kLeaving, it shuts down or is drained; kAbandoned, it heard
  /// no state for too long. As the client found: kNoAnswer, the server fell silent (dead, hanging or cut off).
  ErrorCode why = ErrorCode::kOther;
  std::string server;    ///< that lost it; else who flies the vehicle now
  std::string sentence;  ///< all of that for people, with the server's own words
};

/// The thin client: joins a session, sends state and depth, holds the newest plan, plays it out, and falls back by
/// itself when the plan runs dry (level out, hold height, then descend). A server that dies and returns is joined again
/// without a call; where it has a stand-by, that one goes on and the plan doesn't run dry.
/// Thread-safe: all but play() and applied(), which one thread at a time may call, beside the others.
/// Real-time safe: play() and applied() yes; problems(), problem_change() and newest() only wait for a copy that
/// another thread makes; statistics(), session() and session_change() allocate; the others make system calls.
class Client {
 public:
  /// Blocks until a server accepts, refuses or the timeout passes. A refusal is the error, as the server gave it (code,
  /// field, value, expected, sentence); one that may pass (may_pass(code): the name is in use, the server is full) is
  /// asked again until the timeout, when the refusal says that it is worth while. Nobody answered:
  /// ErrorCode::kNoAnswer. Options that no server would take: ErrorCode::kInvalid, at once.
  /// @param cancel  when it becomes true, joining ends within some 50 ms as if nobody had answered; null: nothing ends
  ///                it early
  static Result<std::unique_ptr<Client>> connect(const Options& options, const std::atomic<bool>* cancel = nullptr);
  virtual ~Client() = default;  ///< leaves the session

  /// The accepted session: control period, plan step, model hash.
  virtual protocol::SessionReply session() const = 0;

  /// @param stamp   client's monotonic clock (or simulated time), the same clock in every call
  /// @param depth_m row-major, width * height of options.camera, 0 = no return
  /// @return the frame's sequence number; 0: not sent, the image has another size
  virtual std::uint64_t send_depth(Stamp stamp, std::span<const float> depth_m) = 0;
  /// The same as most depth cameras deliver it: depth = count * options.camera.metres_per_count (0.001 unless told
  /// otherwise: millimetres).
  virtual std::uint64_t send_depth_counts(Stamp stamp, std::span<const std::uint16_t> counts) = 0;
  /// @return the state's sequence number
  virtual std::uint64_t send_state(Stamp stamp, const QuadrotorState& state, bool thrust_known = true) = 0;

  /// The newest command, once; empty when there is no newer one than last time.
  virtual std::optional<protocol::ThrustRateCommand> newest() = 0;
  /// Lockstep: waits for the command that answers this state (sent again meanwhile, since states are best effort).
  virtual std::optional<protocol::ThrustRateCommand> wait_for_answer(std::uint64_t state_sequence,
                                                                     std::chrono::milliseconds timeout) = 0;

  /// What to apply from `now` until the next call: the plan, or the fallback when it has run out. `state` feeds the
  /// fallback.
  /// @param period  until the next call, 0 to 100 ms (clamped); 0 gives the values at `now`
  virtual Setpoint play(Stamp now, const QuadrotorState& state, std::chrono::nanoseconds period) = 0;
  /// What the vehicle is asked for from `now` on, until the next play() or applied(), where that is not what play()
  /// said: a manoeuvre of a supervisor, a mixture of that and a plan. Empty: nobody here knows, since the motors are
  /// off, the ground carries the vehicle, or somebody else flies it. The states tell it to the server, which would
  /// otherwise predict, and find lags and thrust, by plans that nobody flies. Who applies what play() said has nothing
  /// to tell (and may); neither has a vehicle of rotor thrusts, whose thrust_command_n says it.
  /// Called by the thread that calls play(), after it.
  virtual void applied(Stamp now, const std::optional<Setpoint>& setpoint) = 0;

  /// What the server says is wrong now: what the newest command's health and the newest telemetry's say, together.
  /// 0: nothing known of.
  virtual protocol::Problems problems() const = 0;
  /// The next change of problems(), each once, in the order of hearing; empty: none since. Whoever logs asks now and
  /// then until it is empty; of more than 64 that wait the oldest are lost.
  virtual std::optional<ProblemChange> problem_change() = 0;

  /// The next of what became of the session, each once, in order; empty: nothing since. As with problem_change() the
  /// oldest of more than 64 are lost. A server is silent when it answered no state for a second and said nothing else
  /// for 1.5 s; that is found when a state is sent. A loss is told once, and again when the server then refuses the
  /// vehicle for another reason.
  virtual std::optional<SessionChange> session_change() = 0;

  virtual LinkStatistics statistics() const = 0;
  /// The newest telemetry, if any came since last time.
  virtual std::optional<protocol::Telemetry> telemetry() = 0;
};

/// Sizes, then alignments, of what crosses the interface, as this translation unit lays it out.
template <std::size_t... kBytes>
struct Layout {};
template <typename... Interface>
using LayoutOf = Layout<sizeof(Interface)..., alignof(Interface)...>;
using ClientLayout = LayoutOf<Options, QuadrotorModel, Actuation, CameraModel, Course, QuadrotorState, Setpoint,
                              ProblemChange, SessionChange, LinkStatistics, dds::NetworkOptions, protocol::SessionReply,
                              protocol::ThrustRateCommand, protocol::Telemetry, Error>;

/// What connect() is. Its symbol carries the layout: a program that lays the interface out in another way than the
/// library was compiled with (_GLIBCXX_DEBUG and such; -march and Eigen's alignment make no difference)
/// does not link, instead of flying on garbage.
Result<std::unique_ptr<Client>> connect_if_layouts_agree(const Options& options, const std::atomic<bool>* cancel,
                                                         ClientLayout);

inline Result<std::unique_ptr<Client>> Client::connect(const Options& options, const std::atomic<bool>* cancel) {
  return connect_if_layouts_agree(options, cancel, ClientLayout{});
}

}  // namespace gatefield::sdk
