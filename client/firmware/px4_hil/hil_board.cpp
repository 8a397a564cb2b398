#include "client/firmware/px4_hil/hil_board.h"

#include <algorithm>
#include <utility>

#include "client/firmware/mavlink/constants.h"
#include "client/firmware/px4_hil/simulator_address.h"
#include "common/base/text.h"

namespace gatefield::firmware {
namespace {

using namespace std::chrono_literals;

constexpr Stamp kLook = 5ms;               // how often a waiting listener looks up
constexpr Stamp kHeartbeat = 500ms;        // of ours, while it is waited for
constexpr Stamp kBackwards = 1s;           // its clock goes back by more only when it begins anew
constexpr double kMuchNoise = 0.02;        // of the bytes
constexpr std::uint64_t kMotorBits = 0xF;  // of HIL_ACTUATOR_CONTROLS.flags: outputs 1 to 4 are motors

}  // namespace

HilBoard::HilBoard(const HilOptions& options, std::unique_ptr<Link> link, std::unique_ptr<Clock> clock)
    : options_(options), link_(std::move(link)), clock_(std::move(clock)) {}

// ---- sentences -----------------------------------------------------------------------------------------------------

std::string HilBoard::condition() const {
  std::string sentence;
  const double noise = static_cast<double>(reader_.counts().noise_bytes);
  if (received_ > 0 && noise > kMuchNoise * static_cast<double>(received_))
    sentence += "; " + fixed(1e2 * noise / static_cast<double>(received_), 0) +
                " % of the bytes that came from it were noise: look at cable, ground and baud rate";
  if (unsent_ > 0)
    sentence += "; " + text(unsent_) + " samples found no room on the line: the board does not read them";
  return sentence;
}

Error HilBoard::lost(const std::string& what) const {
  return Error("the board on " + link_->name() + " " + what + condition(), ErrorCode::kNotAnswering, "address");
}

Error HilBoard::nobody() const {
  std::string sentence;
  if (received_ == 0) {
    sentence = "nothing came from " + link_->name() + " within " + text(seconds(options_.connect_timeout)) +
               " s; look at cable, power and the device's name, and that MAVLink is on at that port (MAV_0_CONFIG and "
               "the like, SYS_USB_AUTO)";
  } else if (reader_.counts().frames == 0) {
    sentence = text(received_) + " bytes came from " + link_->name() +
               " and no MAVLink frame that is known was among them; check the baud rate, and that the port speaks "
               "MAVLink";
  } else {
    sentence = text(reader_.counts().frames) + " messages came from " + link_->name() +
               " and no heartbeat of an autopilot was among them; this is another device's port";
  }
  return Error(sentence, ErrorCode::kNoAnswer, "address");
}

Error HilBoard::not_in_hil_mode(const std::string& what) const {
  return Error("the board on " + link_->name() + " " + what +
                   "; set SYS_HITL to 1 (airframe 1001, HIL Quadcopter X) and start it again",
               ErrorCode::kInvalid, "SYS_HITL");
}

// ---- hearing -------------------------------------------------------------------------------------------------------

Status HilBoard::receive() {
  Status status;
  for (;;) {
    const Transfer transfer = link_->receive(buffer_);
    if (transfer.broken != 0) {
      Error error = broken(*link_, transfer);
      error.code = ErrorCode::kNotAnswering;
      error.field = "address";
      return error;
    }
    if (transfer.bytes == 0) return status;
    received_ += transfer.bytes;
    const Stamp now = clock_->now();
    reader_.read({buffer_.data(), transfer.bytes}, false, [&](const mavlink::Frame& frame) {
      const auto message = mavlink::unpack(frame);
      if (message) take(now, frame, *message, &status);
    });
    if (!status) return status;
  }
}

void HilBoard::take(Stamp now, const mavlink::Frame& frame, const mavlink::Message& message, Status* status) {
  const auto* const heartbeat = std::get_if<mavlink::Heartbeat>(&message);
  if (!peer_) {
    const bool autopilot =
        heartbeat != nullptr &&
        static_cast<mavlink::AutopilotKind>(heartbeat->autopilot) != mavlink::AutopilotKind::kInvalid &&
        static_cast<mavlink::VehicleType>(heartbeat->type) != mavlink::VehicleType::kGroundStation;
    if (!autopilot) return;
    peer_ = frame.from;
    hil_at_ = now;
  } else if (frame.from != *peer_) {
    return;
  }
  heard_ = now;
  // Other messages carry the time of what they tell, which may be old, or none.
  if (const auto* const time = std::get_if<mavlink::SystemTime>(&message))
    note_boot_time(std::chrono::milliseconds(time->time_boot_ms));
  if (heartbeat != nullptr) take(now, *heartbeat);
  const auto* const controls = std::get_if<mavlink::HilActuatorControls>(&message);
  if (controls != nullptr && status->ok()) *status = take(now, *controls);
}

void HilBoard::take(Stamp now, const mavlink::Heartbeat& heartbeat) {
  hil_ = (heartbeat.base_mode & mavlink::kModeHil) != 0;
  was_hil_ = was_hil_ || hil_;
  if (hil_) hil_at_ = now;
  note_armed(now, (heartbeat.base_mode & mavlink::kModeArmed) != 0);
}

Status HilBoard::take(Stamp now, const mavlink::HilActuatorControls& controls) {
  note_boot_time(std::chrono::microseconds(std::min<std::uint64_t>(controls.time_usec, INT64_MAX / 1000)));
  note_armed(now, (controls.mode & mavlink::kModeArmed) != 0);
  answered_at_ = now;
  // Older releases leave them 0.
  if (controls.flags != 0 && (controls.flags & kMotorBits) != kMotorBits)
    return Error("HIL_ACT_FUNC: outputs 1 to 4 of the board on " + link_->name() +
                     " are not all motors, expected HIL_ACT_FUNC1 to 4 to be 101 to 104",
                 ErrorCode::kInvalid, "HIL_ACT_FUNC");
  return motors_.take(controls);
}

void HilBoard::note_boot_time(Stamp since_boot) noexcept {
  if (since_boot_ && since_boot < *since_boot_ - kBackwards) restarted_ = true;
  since_boot_ = since_boot_ ? std::max(*since_boot_, since_boot) : since_boot;
}

void HilBoard::note_armed(Stamp now, bool armed) noexcept {
  if (armed && !armed_) armed_since_ = now;
  armed_ = armed;
}

Status HilBoard::check(Stamp now) const {
  if (restarted_) return lost("started again; look at its power, and at what it says of its last boot");
  if (peer_ && !hil_ && now - hil_at_ > kModeGrace)
    return not_in_hil_mode(was_hil_ ? "has left HIL mode" : "is not in HIL mode");
  if (armed_ && motors_.answers == 0 && now - armed_since_ > std::max(kFirstMotors, options_.silence_limit))
    return lost("is armed and sent no motor outputs for " + fixed(seconds(now - armed_since_), 1) +
                " s; a UART sends them at a rate above 5000 bytes a second alone (MAV_0_RATE and the like), and the "
                "firmware needs its module pwm_out_sim");
  if (armed_ && motors_.answers > 0 && now - std::max(answered_at_, armed_since_) > options_.silence_limit)
    return lost("sent no motor outputs for " + fixed(seconds(now - answered_at_), 1) +
                " s; it hangs, lost power, or starts again");
  if (peer_ && now - heard_ > kSilent)
    return lost("has been silent for " + fixed(seconds(now - heard_), 1) + " s; look at its cable and power");
  return {};
}

Result<HilMotors> HilBoard::hear() {
  if (Status status = receive(); !status) return status.failure();
  if (Status status = check(clock_->now()); !status) return status.failure();
  return motors_;
}

Status HilBoard::connect() {
  const Stamp end = clock_->now() + options_.connect_timeout;
  mavlink::Heartbeat heartbeat;
  heartbeat.type = static_cast<std::uint8_t>(mavlink::VehicleType::kOnboardController);
  heartbeat.autopilot = static_cast<std::uint8_t>(mavlink::AutopilotKind::kInvalid);
  heartbeat.system_status = static_cast<std::uint8_t>(mavlink::SystemStatus::kActive);
  for (Stamp next = clock_->now(); !hil_;) {
    const auto motors = hear();
    if (!motors) return motors.failure();
    const Stamp now = clock_->now();
    if (!peer_ && now >= end) return nobody();
    if (now >= next) {
      next = now + kHeartbeat;
      if (Status status = send(heartbeat); !status) return status;
    }
    link_->wait(kLook);
  }
  return {};
}

// ---- speaking ------------------------------------------------------------------------------------------------------

Status HilBoard::send(const mavlink::Message& message) {
  const Transfer transfer = link_->send(mavlink::pack(message, kSimulatorAddress, sequence_).bytes());
  if (transfer.broken != 0) {
    Error error = broken(*link_, transfer);
    error.code = ErrorCode::kNotAnswering;
    error.field = "address";
    return error;
  }
  if (transfer.bytes > 0)
    ++sequence_;
  else if (std::holds_alternative<mavlink::HilSensor>(message))
    ++unsent_;
  return {};
}

Status HilBoard::send(const mavlink::HilSensor& sensor, const std::optional<mavlink::HilGps>& gps) {
  if (gps)
    if (Status status = send(mavlink::Message(*gps)); !status) return status;
  return send(mavlink::Message(sensor));
}

}  // namespace gatefield::firmware
