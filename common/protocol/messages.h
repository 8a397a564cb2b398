#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "common/base/clock.h"
#include "common/base/result.h"
#include "common/course/course.h"
#include "common/geometry/camera.h"
#include "common/protocol/asked.h"
#include "common/protocol/identified_drive.h"
#include "common/protocol/problems.h"
#include "common/vehicle/actuation.h"
#include "common/vehicle/quadrotor.h"

/// What clients and the planning server say to each other, as the program sees it (the IDL in idl/ is how it travels).
/// All stamps are of the *client's* clock; the server echoes them and never compares them with its own.
namespace gatefield::protocol {

/// Version of the wire; a server refuses any other.
inline constexpr std::uint32_t kVersion = 2;

inline constexpr std::size_t kMaxNameLength = 63;  ///< vehicle names: [A-Za-z0-9_.-], 1 to 63 characters
inline constexpr std::size_t kMaxReasonLength = 511;
inline constexpr std::size_t kMaxFieldLength = 127;  ///< of a field's path, value and range
inline constexpr int kMaxPlanSteps = 64;
inline constexpr std::uint8_t kUsualPriority = 5;
inline constexpr std::uint8_t kMaxPriority = 9;
inline constexpr double kMaxRetryAfter_s = 3600.0;

/// A participant of the middleware, by its bytes; all zero: none.
using ParticipantBytes = std::array<std::uint8_t, 12>;

enum class Timing : std::uint8_t {
  kRealTime = 0,  ///< the server plans at its control rate from the newest state
  kLockstep = 1,  ///< the server answers every state exactly once, after the depth frame that the state names
};

struct SessionRequest {
  enum class Action : std::uint8_t { kJoin = 0, kLeave = 1 };
  std::uint32_t version = kVersion;
  std::string vehicle;  ///< name; key of every topic of this vehicle
  /// The client's number for this attempt, echoed in the reply; never 0; a new one for each start.
  std::uint64_t request = 0;
  Action action = Action::kJoin;
  Timing timing = Timing::kRealTime;
  std::string profile = "race";  ///< planner profile's name
  std::uint64_t seed = 1;        ///< of the planner's sampling
  double speed_limit_m_s = 0.0;  ///< soft cap on speed; 0 = the profile's
  /// 0 to kMaxPriority: who has least is served last when the server can't serve all.
  std::uint8_t priority = kUsualPriority;
  QuadrotorModel quadrotor;
  Actuation actuation;
  CameraModel camera;
  Course course;
};

struct SessionReply {
  std::uint32_t version = kVersion;  ///< of a refusal: the version of who asked
  std::string vehicle;
  std::uint64_t request = 0;  ///< which request this answers
  bool accepted = false;
  std::string reason;                  ///< when refused: the field, its value and what was expected; else empty
  ErrorCode code = ErrorCode::kOther;  ///< when refused: its kind; may_pass() says whether to ask again
  std::string field;                   ///< when refused: path of the field that was wrong; empty: no field's fault
  std::string value;                   ///< its value as text
  std::string expected;                ///< what would have been right
  std::string server;                  ///< the answering server's name
  std::uint64_t session = 0;           ///< goes into every later sample; never 0 when accepted
  double control_period_s = 0.0;
  double plan_step_s = 0.0;
  int plan_steps = 0;
  std::uint64_t model_hash = 0;  ///< names the model bundle in use
  double retry_after_s = 0.0;    ///< when refused: not worth asking again before; 0 = not known
  /// When accepted: who goes on with the session, under the same number, when this server falls silent.
  ParticipantBytes heir{};
};

struct VehicleState {
  std::string vehicle;
  std::uint64_t session = 0;
  std::uint64_t sequence = 0;  ///< from 1, rising
  Stamp stamp{0};              ///< when the state held
  QuadrotorState state;
  bool thrust_known = true;          ///< state.thrust_n is measured or estimated; else the server models it
  Stamp round_trip{0};               ///< newest state-to-command round trip that the client measured; 0 = none yet
  std::uint64_t depth_sequence = 0;  ///< newest depth frame sent before this state; 0 = none
  std::uint32_t heard_waypoint = 0;  ///< target and lap of the newest command heard: where a restarted server goes on
  std::uint32_t heard_lap = 0;
  Asked asked;
};

enum class DepthEncoding : std::uint8_t {
  kCounts16 = 0,  ///< uint16 of CameraModel::metres_per_count, little endian; 0 = no return
  kMetres32 = 1,  ///< IEEE float32, little endian; 0, NaN or infinity = no return
};
inline constexpr std::size_t bytes_per_pixel(DepthEncoding encoding) noexcept {
  return encoding == DepthEncoding::kCounts16 ? 2 : 4;
}

/// Intrinsics and mounting came with the session; a frame whose size differs from them is dropped.
struct DepthFrame {
  std::string vehicle;
  std::uint64_t session = 0;
  std::uint64_t sequence = 0;  ///< from 1, rising
  Stamp stamp{0};              ///< of the capture (middle of the exposure)
  std::uint32_t width_px = 0;
  std::uint32_t height_px = 0;
  DepthEncoding encoding = DepthEncoding::kCounts16;
  std::vector<std::uint8_t> pixels;  ///< row-major, width * height * bytes_per_pixel
};

/// How the planner is doing; travels in every command.
struct PlannerHealth {
  double solve_time_s = 0.0;          ///< of the step that made this plan
  double effective_samples = 0.0;     ///< 1 / sum w^2
  double lowest_field_m = 0.0;        ///< lowest Gate-SDF value along the commanded plan
  double latent_age_s = -1.0;         ///< age of the field in use; -1 = none yet
  double state_age_s = 0.0;           ///< how far the state was predicted forward
  std::uint32_t target_waypoint = 0;  ///< index into the course
  std::uint32_t lap = 0;              ///< from 0
  bool course_done = false;
  bool degraded = false;  ///< flying on prediction: input missing, late or rejected
  Problems problems = 0;  ///< what is wrong now
};

/// The plan: thrust rates at plan_step intervals from plan_start on, and what they imply at the end of each interval.
struct ThrustRateCommand {
  std::string vehicle;
  std::uint64_t session = 0;
  std::uint64_t sequence = 0;          ///< from 1, rising
  std::uint64_t answers_sequence = 0;  ///< the state this plan starts from
  Stamp answers_stamp{0};              ///< that state's stamp, echoed
  Stamp plan_start{0};                 ///< client's clock: when thrust_rate_n_s[0] begins to hold; 0 to 2^62 ns
  Stamp plan_step{0};
  Stamp validity{0};  ///< after plan_start + validity the client falls back by itself
  int steps = 0;      ///< 1 to kMaxPlanSteps
  std::array<PlainVector4, kMaxPlanSteps> thrust_rate_n_s;      ///< du per rotor
  std::array<PlainVector4, kMaxPlanSteps> rotor_thrust_n;       ///< commanded thrust at the end of the interval
  std::array<double, kMaxPlanSteps> collective_thrust_n;        ///< sum of the above
  std::array<Eigen::Vector3d, kMaxPlanSteps> body_rates_rad_s;  ///< predicted w_WB_B at the end of the interval, FLU
  PlannerHealth health;
  Actuation::Kind actuation = Actuation::Kind::kRotorThrusts;  ///< what the plan is made of
  std::array<char, 16> isa{};                                  ///< instruction set of the kernels, zero-terminated
};

/// Once or a few times a second, for people and tools; nothing on the control path depends on it.
struct Telemetry {
  std::string vehicle;
  std::uint64_t session = 0;
  Stamp server_stamp{0};  ///< server's clock
  PlannerHealth health;
  std::uint64_t states_received = 0, states_rejected = 0;
  std::uint64_t frames_received = 0, frames_rejected = 0;
  std::uint64_t frames_invalid = 0;  ///< taken, but nothing to see in them
  std::uint64_t commands_sent = 0, deadlines_missed = 0;
  double encode_time_s = 0.0;
  IdentifiedDrive identified;
  ErrorCode last_code = ErrorCode::kOther;  ///< of the newest sample that was rejected: its kind
  std::string last_field;                   ///< path of the field that was wrong; empty: no field's fault
  std::string last_value;                   ///< its value as text
  std::string last_expected;                ///< what would have been right
  std::string last_reason;                  ///< the sentence; empty = none was rejected
  std::string isa;
};

}  // namespace gatefield::protocol
