#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <string_view>
#include <variant>

#include "common/base/result.h"

/// What PX4 says and hears over its uXRCE-DDS agent, as plain structs of what is used; idl/px4.idl has all fields,
/// their frames and where they are written down.
namespace gatefield::px4 {

inline constexpr float kNoKnob = std::numeric_limits<float>::quiet_NaN();

/// Stamps: microseconds; 0 in what PX4 hears: stamped when it arrives. Larger ones than this count from 1970 (it is
/// 2001 then, or PX4 has been running for 31 years).
inline constexpr std::uint64_t kSince1970_us = 1'000'000'000'000'000;

// ---- to PX4 --------------------------------------------------------------------------------------------------------

struct OffboardControlMode {
  static constexpr std::string_view kTopic = "offboard_control_mode";
  std::uint64_t timestamp = 0;
  bool position = false, velocity = false, acceleration = false, attitude = false, body_rate = false,
       thrust_and_torque = false, direct_actuator = false;
  friend bool operator==(const OffboardControlMode&, const OffboardControlMode&) = default;
};

struct VehicleRatesSetpoint {
  static constexpr std::string_view kTopic = "vehicle_rates_setpoint";
  std::uint64_t timestamp = 0;
  float roll = 0, pitch = 0, yaw = 0;  ///< FRD, rad/s
  std::array<float, 3> thrust_body{};  ///< FRD, of the most there is: up is (0, 0, -thrust)
  bool reset_integral = false;
  friend bool operator==(const VehicleRatesSetpoint&, const VehicleRatesSetpoint&) = default;
};

/// MAVLink's COMMAND_LONG.
struct VehicleCommand {
  static constexpr std::string_view kTopic = "vehicle_command";
  std::uint64_t timestamp = 0;
  float param1 = 0, param2 = 0, param3 = 0, param4 = 0;
  double param5 = 0, param6 = 0;
  float param7 = 0;
  std::uint32_t command = 0;
  std::uint8_t target_system = 0, target_component = 0, source_system = 0;
  std::uint16_t source_component = 0;
  std::uint8_t confirmation = 0;
  bool from_external = true;
  friend bool operator==(const VehicleCommand&, const VehicleCommand&) = default;
};

// ---- from PX4 ------------------------------------------------------------------------------------------------------

/// MAVLink's COMMAND_ACK, to whom the command named as its source.
struct VehicleCommandAck {
  static constexpr std::string_view kTopic = "vehicle_command_ack";
  std::uint64_t timestamp = 0;
  std::uint32_t command = 0;
  std::uint8_t result = 0;
  std::uint8_t result_param1 = 0;
  std::int32_t result_param2 = 0;
  std::uint8_t target_system = 0;
  std::uint16_t target_component = 0;
  bool from_external = false;
  friend bool operator==(const VehicleCommandAck&, const VehicleCommandAck&) = default;
};

/// Frames of VehicleOdometry. kNed and kFrd have z down and differ in their heading: north, or anything.
enum class PoseFrame : std::uint8_t { kUnknown = 0, kNed = 1, kFrd = 2 };
enum class VelocityFrame : std::uint8_t { kUnknown = 0, kNed = 1, kFrd = 2, kBodyFrd = 3 };

struct VehicleOdometry {
  static constexpr std::string_view kTopic = "vehicle_odometry";
  std::uint64_t timestamp = 0;
  std::uint64_t timestamp_sample = 0;       ///< when it held
  std::uint8_t pose_frame = 1;              ///< PoseFrame
  std::array<float, 3> position{};          ///< m
  std::array<float, 4> q{1, 0, 0, 0};       ///< w first, body FRD to the frame
  std::uint8_t velocity_frame = 1;          ///< VelocityFrame
  std::array<float, 3> velocity{};          ///< m/s
  std::array<float, 3> angular_velocity{};  ///< FRD, rad/s
  std::array<float, 3> position_variance{}, orientation_variance{}, velocity_variance{};
  std::uint8_t reset_counter = 0;  ///< counts jumps of the estimate
  std::int8_t quality = 0;         ///< -1: failed
  friend bool operator==(const VehicleOdometry&, const VehicleOdometry&) = default;
};

/// VehicleStatus.arming_state.
inline constexpr std::uint8_t kArmed = 2, kDisarmed = 1;
/// VehicleStatus.nav_state.
inline constexpr std::uint8_t kNavTermination = 13, kNavOffboard = 14, kNavStates = 31;

struct VehicleStatus {
  static constexpr std::string_view kTopic = "vehicle_status";
  std::uint64_t timestamp = 0;
  std::uint8_t arming_state = kDisarmed;
  std::uint8_t nav_state = 0;
  bool failsafe = false;                     ///< its own failsafe flies ..
  bool failsafe_and_user_took_over = false;  ///< .. or would, and a person does
  std::uint8_t system_id = 1;
  std::uint8_t component_id = 1;
  bool pre_flight_checks_pass = false;
  friend bool operator==(const VehicleStatus&, const VehicleStatus&) = default;
};

struct VehicleLandDetected {
  static constexpr std::string_view kTopic = "vehicle_land_detected";
  std::uint64_t timestamp = 0;
  bool ground_contact = false, maybe_landed = false, landed = false;  ///< one after the other
  friend bool operator==(const VehicleLandDetected&, const VehicleLandDetected&) = default;
};

struct SensorCombined {
  static constexpr std::string_view kTopic = "sensor_combined";
  static constexpr std::int32_t kNoAccelerometer = 0x7fffffff;  ///< accelerometer_timestamp_relative
  std::uint64_t timestamp = 0;
  std::array<float, 3> gyro_rad{};                     ///< FRD, rad/s
  std::int32_t accelerometer_timestamp_relative = 0;   ///< us
  std::array<float, 3> accelerometer_m_s2{0, 0, -10};  ///< specific force, FRD
  friend bool operator==(const SensorCombined&, const SensorCombined&) = default;
};

struct TimesyncStatus {
  static constexpr std::string_view kTopic = "timesync_status";
  static constexpr std::uint8_t kDds = 2;  ///< source_protocol
  std::uint64_t timestamp = 0;
  std::uint8_t source_protocol = kDds;
  std::uint64_t remote_timestamp = 0;
  std::int64_t observed_offset = 0;   ///< us, of one question and answer
  std::int64_t estimated_offset = 0;  ///< us, smoothed: what stamps are translated by
  std::uint32_t round_trip_time = 0;  ///< us
  friend bool operator==(const TimesyncStatus&, const TimesyncStatus&) = default;
};

struct ManualControlSetpoint {
  static constexpr std::string_view kTopic = "manual_control_setpoint";
  static constexpr std::size_t kAuxes = 6;
  std::uint64_t timestamp = 0;
  bool valid = false;
  std::array<float, kAuxes> aux{kNoKnob, kNoKnob, kNoKnob, kNoKnob, kNoKnob, kNoKnob};  ///< -1 to 1
};

struct InputRc {
  static constexpr std::string_view kTopic = "input_rc";
  static constexpr std::size_t kChannels = 18;
  std::uint64_t timestamp = 0;
  std::uint8_t channel_count = 0;
  bool rc_failsafe = false, rc_lost = false;
  std::array<std::uint16_t, kChannels> values{};  ///< us
  friend bool operator==(const InputRc&, const InputRc&) = default;
};

struct BatteryStatus {
  static constexpr std::string_view kTopic = "battery_status";
  std::uint64_t timestamp = 0;
  bool connected = false;
  float voltage_v = 0;  ///< of the pack; 0: not known
  friend bool operator==(const BatteryStatus&, const BatteryStatus&) = default;
};

/// Everything that is heard of PX4.
using Message = std::variant<VehicleOdometry, VehicleStatus, VehicleCommandAck, VehicleLandDetected, SensorCombined,
                             TimesyncStatus, ManualControlSetpoint, InputRc, BatteryStatus>;

/// What of a message is out of its range: numbers that are not finite or not possible, quaternions that are none,
/// frames, modes and states that are not known, stamps of 0 or beyond the year 2255. NaN is accepted where it means
/// "there is none" (knobs). Errors: kInvalid with topic and field, as in "vehicle_odometry.position[0]".
/// Thread-safe: yes.   Real-time safe: only when it is good.
Status validate(const VehicleOdometry& message);
Status validate(const VehicleStatus& message);
Status validate(const VehicleCommandAck& message);
Status validate(const VehicleLandDetected& message);
Status validate(const SensorCombined& message);
Status validate(const TimesyncStatus& message);
Status validate(const ManualControlSetpoint& message);
Status validate(const InputRc& message);
Status validate(const BatteryStatus& message);

}  // namespace gatefield::px4
