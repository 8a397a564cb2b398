#pragma once

#include <array>
#include <cstdint>
#include <limits>

#include "client/firmware/mavlink/field.h"

/// Messages that ask a vehicle for something, and its answers. Names of fields are those of the definitions
/// (mavlink.io, "MAVLINK common message set").
namespace gatefield::firmware::mavlink {

/// Attitude, body rates and thrust to follow from now on.
struct SetAttitudeTarget {
  static constexpr std::uint32_t kId = 82;
  static constexpr std::string_view kName = "SET_ATTITUDE_TARGET";
  std::uint32_t time_boot_ms = 0;                                    ///< of the sender
  std::array<float, 4> q{1, 0, 0, 0};                                ///< FRD to NED, w first
  float body_roll_rate = 0, body_pitch_rate = 0, body_yaw_rate = 0;  ///< FRD, rad/s
  float thrust = 0;                                                  ///< of the most there is, 0 to 1
  std::uint8_t target_system = 0;
  std::uint8_t target_component = 0;
  std::uint8_t type_mask = 0;          ///< what to ignore: kIgnoreAttitude
  std::array<float, 3> thrust_body{};  ///< of vehicles that push in several directions
  static constexpr auto fields() {
    return std::tuple{field("time_boot_ms", &SetAttitudeTarget::time_boot_ms),
                      field("q", &SetAttitudeTarget::q, unit_quaternion()),
                      field("body_roll_rate", &SetAttitudeTarget::body_roll_rate, around_zero(100, "rad/s")),
                      field("body_pitch_rate", &SetAttitudeTarget::body_pitch_rate, around_zero(100, "rad/s")),
                      field("body_yaw_rate", &SetAttitudeTarget::body_yaw_rate, around_zero(100, "rad/s")),
                      field("thrust", &SetAttitudeTarget::thrust, within(0, 1)),
                      field("target_system", &SetAttitudeTarget::target_system),
                      field("target_component", &SetAttitudeTarget::target_component),
                      field("type_mask", &SetAttitudeTarget::type_mask),
                      extension("thrust_body", &SetAttitudeTarget::thrust_body, around_zero(1))};
  }
};

/// A command with seven numbers; NaN where the command has no use for one or keeps what is. COMMAND_ACK answers.
struct CommandLong {
  static constexpr std::uint32_t kId = 76;
  static constexpr std::string_view kName = "COMMAND_LONG";
  float param1 = 0, param2 = 0, param3 = 0, param4 = 0, param5 = 0, param6 = 0, param7 = 0;
  std::uint16_t command = 0;  ///< Command
  std::uint8_t target_system = 0;
  std::uint8_t target_component = 0;
  std::uint8_t confirmation = 0;  ///< 0 at first, then counts repetitions
  static constexpr auto fields() {
    constexpr Allowed kNumber = or_unknown(around_zero(std::numeric_limits<float>::max()));
    return std::tuple{
        field("param1", &CommandLong::param1, kNumber),      field("param2", &CommandLong::param2, kNumber),
        field("param3", &CommandLong::param3, kNumber),      field("param4", &CommandLong::param4, kNumber),
        field("param5", &CommandLong::param5, kNumber),      field("param6", &CommandLong::param6, kNumber),
        field("param7", &CommandLong::param7, kNumber),      field("command", &CommandLong::command),
        field("target_system", &CommandLong::target_system), field("target_component", &CommandLong::target_component),
        field("confirmation", &CommandLong::confirmation)};
  }
};

struct CommandAck {
  static constexpr std::uint32_t kId = 77;
  static constexpr std::string_view kName = "COMMAND_ACK";
  std::uint16_t command = 0;
  std::uint8_t result = 0;         ///< CommandResult
  std::uint8_t progress = 0;       ///< %, of a command in progress; 0xFF: not known
  std::int32_t result_param2 = 0;  ///< more about the result, of the command's own kind
  std::uint8_t target_system = 0;  ///< who had asked; 0: not said
  std::uint8_t target_component = 0;
  static constexpr auto fields() {
    return std::tuple{field("command", &CommandAck::command),
                      field("result", &CommandAck::result),
                      extension("progress", &CommandAck::progress),
                      extension("result_param2", &CommandAck::result_param2),
                      extension("target_system", &CommandAck::target_system),
                      extension("target_component", &CommandAck::target_component)};
  }
};

/// The older way to change the mode; nobody answers.
struct SetMode {
  static constexpr std::uint32_t kId = 11;
  static constexpr std::string_view kName = "SET_MODE";
  std::uint32_t custom_mode = 0;
  std::uint8_t target_system = 0;
  std::uint8_t base_mode = 0;  ///< bits kMode...
  static constexpr auto fields() {
    return std::tuple{field("custom_mode", &SetMode::custom_mode), field("target_system", &SetMode::target_system),
                      field("base_mode", &SetMode::base_mode)};
  }
};

/// A parameter's name: up to 16 characters, ended by NUL when it has fewer.
using ParameterName = std::array<char, 16>;

struct ParamRequestRead {
  static constexpr std::uint32_t kId = 20;
  static constexpr std::string_view kName = "PARAM_REQUEST_READ";
  std::int16_t param_index = -1;  ///< -1: the name says which
  std::uint8_t target_system = 0;
  std::uint8_t target_component = 0;
  ParameterName param_id{};
  static constexpr auto fields() {
    return std::tuple{field("param_index", &ParamRequestRead::param_index),
                      field("target_system", &ParamRequestRead::target_system),
                      field("target_component", &ParamRequestRead::target_component),
                      field("param_id", &ParamRequestRead::param_id, printable())};
  }
};

struct ParamValue {
  static constexpr std::uint32_t kId = 22;
  static constexpr std::string_view kName = "PARAM_VALUE";
  float param_value = 0;  ///< any bits: those of an integer, where the sender has it so (ParameterType)
  std::uint16_t param_count = 0;
  std::uint16_t param_index = 0;
  ParameterName param_id{};
  std::uint8_t param_type = 0;  ///< ParameterType
  static constexpr auto fields() {
    return std::tuple{field("param_value", &ParamValue::param_value), field("param_count", &ParamValue::param_count),
                      field("param_index", &ParamValue::param_index),
                      field("param_id", &ParamValue::param_id, printable()),
                      field("param_type", &ParamValue::param_type)};
  }
};

/// PARAM_VALUE answers.
struct ParamSet {
  static constexpr std::uint32_t kId = 23;
  static constexpr std::string_view kName = "PARAM_SET";
  float param_value = 0;  ///< as of ParamValue
  std::uint8_t target_system = 0;
  std::uint8_t target_component = 0;
  ParameterName param_id{};
  std::uint8_t param_type = 0;  ///< ParameterType
  static constexpr auto fields() {
    return std::tuple{field("param_value", &ParamSet::param_value), field("target_system", &ParamSet::target_system),
                      field("target_component", &ParamSet::target_component),
                      field("param_id", &ParamSet::param_id, printable()), field("param_type", &ParamSet::param_type)};
  }
};

}  // namespace gatefield::firmware::mavlink
