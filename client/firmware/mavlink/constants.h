#pragma once

#include <cstdint>

/// The numbers of MAVLink's enumerations that are used here (mavlink.io, "MAVLINK common message set"), and those of
/// PX4's and ArduPilot's own modes.
namespace gatefield::firmware::mavlink {

/// HEARTBEAT.type (MAV_TYPE).
enum class VehicleType : std::uint8_t { kQuadrotor = 2, kGroundStation = 6, kOnboardController = 18 };

/// HEARTBEAT.autopilot (MAV_AUTOPILOT).
enum class AutopilotKind : std::uint8_t { kGeneric = 0, kArduPilot = 3, kInvalid = 8, kPx4 = 12 };

/// HEARTBEAT.base_mode, HIL_ACTUATOR_CONTROLS.mode (MAV_MODE_FLAG).
inline constexpr std::uint8_t kModeCustom = 1;
inline constexpr std::uint8_t kModeHil = 32;
inline constexpr std::uint8_t kModeArmed = 128;

/// HEARTBEAT.system_status (MAV_STATE).
enum class SystemStatus : std::uint8_t {
  kUninitialised = 0,
  kBoot = 1,
  kCalibrating = 2,
  kStandby = 3,
  kActive = 4,
  kCritical = 5,
  kEmergency = 6,
  kPowerOff = 7,
  kTermination = 8,
};

/// COMMAND_LONG.command (MAV_CMD).
enum class Command : std::uint16_t {
  kDoSetMode = 176,            ///< param1 base mode, param2 custom mode, param3 custom sub-mode
  kDoFlightTermination = 185,  ///< param1 above 0.5: motors off, no way back
  kArmDisarm = 400,            ///< param1 1 arm, 0 disarm; param2 kForceDisarm: in the air, too
  kSetMessageInterval = 511,   ///< param1 message id, param2 microseconds between two
  kRequestMessage = 512,       ///< param1 message id
};
inline constexpr float kForceDisarm = 21196.0F;

/// COMMAND_ACK.result (MAV_RESULT).
enum class CommandResult : std::uint8_t {
  kAccepted = 0,
  kTemporarilyRejected = 1,
  kDenied = 2,
  kUnsupported = 3,
  kFailed = 4,
  kInProgress = 5,
  kCancelled = 6,
};

/// ODOMETRY.frame_id and child_frame_id (MAV_FRAME).
enum class AxesFrame : std::uint8_t {
  kLocalNed = 1,
  kBodyFrd = 12,
  kLocalFrd = 20,
  kLocalFlu = 21,
};

/// SET_ATTITUDE_TARGET.type_mask (ATTITUDE_TARGET_TYPEMASK): what of the message is to be ignored.
inline constexpr std::uint8_t kIgnoreAttitude = 128;

/// PARAM_VALUE.param_type (MAV_PARAM_TYPE). ArduPilot sends every value as the float it equals; PX4 sends the bytes of
/// an integer in the float's place.
enum class ParameterType : std::uint8_t {
  kUint8 = 1,
  kInt8 = 2,
  kUint16 = 3,
  kInt16 = 4,
  kUint32 = 5,
  kInt32 = 6,
  kFloat = 9
};

/// STATUSTEXT.severity (MAV_SEVERITY), the more severe the smaller.
enum class Severity : std::uint8_t { kEmergency = 0, kAlert, kCritical, kError, kWarning, kNotice, kInfo, kDebug };

/// EXTENDED_SYS_STATE.landed_state (MAV_LANDED_STATE).
enum class LandedState : std::uint8_t { kUnknown = 0, kOnGround = 1, kInAir = 2, kTakingOff = 3, kLanding = 4 };

/// HIL_SENSOR.fields_updated (HIL_SENSOR_UPDATED_FLAGS).
inline constexpr std::uint32_t kHilAccelerometer = 0x0007;
inline constexpr std::uint32_t kHilGyroscope = 0x0038;
inline constexpr std::uint32_t kHilMagnetometer = 0x01C0;
inline constexpr std::uint32_t kHilBarometer = 0x1A00;  ///< pressure, altitude, temperature

/// HIL_ACTUATOR_CONTROLS.flags: the sender waits for the simulator's time.
inline constexpr std::uint64_t kHilLockstep = 1;

/// PX4's custom_mode: main mode in bits 16 to 23, sub-mode in bits 24 to 31.
inline constexpr std::uint8_t kPx4Offboard = 6;
inline constexpr std::uint32_t px4_custom_mode(std::uint8_t main_mode, std::uint8_t sub_mode = 0) noexcept {
  return (static_cast<std::uint32_t>(main_mode) << 16) | (static_cast<std::uint32_t>(sub_mode) << 24);
}

/// ArduCopter's custom_mode.
inline constexpr std::uint32_t kArduCopterGuided = 4;
/// Of ArduCopter's parameter GUID_OPTIONS: thrust of SET_ATTITUDE_TARGET means thrust, not a rate of climb.
inline constexpr std::uint32_t kGuidedThrustAsThrust = 1U << 3;

}  // namespace gatefield::firmware::mavlink
