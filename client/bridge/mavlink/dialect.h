#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "client/firmware/mavlink/constants.h"
#include "client/firmware/mavlink/messages_command.h"
#include "client/firmware/mavlink/messages_link.h"
#include "client/flight/ports.h"

namespace gatefield::bridge {

namespace mavlink = firmware::mavlink;

/// Whose MAVLink it is. All take SET_ATTITUDE_TARGET; they differ in the mode in which they follow it, in parameters,
/// and in what they do when setpoints stop.
enum class Dialect : std::uint8_t {
  kPx4,        ///< mode OFFBOARD, which wants setpoints before it is entered
  kArduPilot,  ///< mode GUIDED, with the bit of GUID_OPTIONS that makes thrust mean thrust
  kPlain,      ///< arming alone (AI Grand Prix and other simulators)
};

/// A parameter that matters, and what is made of it.
struct ParameterRule {
  std::string_view name;
  enum class Use : std::uint8_t {
    kThrustBit,  ///< needs kGuidedThrustAsThrust
    kTimeout,    ///< s after the last setpoint until the failsafe acts
    kAction,     ///< what the failsafe does
  } use;
};

/// What differs. Thread-safe: yes (constants).   Real-time safe: yes.
struct DialectRules {
  std::string_view name;
  std::optional<mavlink::AutopilotKind> autopilot;  ///< what its heartbeat must say; empty: anything
  std::string_view autopilot_name;
  std::string_view mode_name;  ///< of the mode in which setpoints are followed; empty: no such mode
  float mode_number = 0;       ///< second parameter of the command that enters it
  std::span<const ParameterRule> parameters;
  bool integers_as_bytes = false;  ///< PARAM_VALUE has an integer's bytes, not its value as a float
};
const DialectRules& rules(Dialect dialect) noexcept;

/// True when our setpoints are what it flies.
bool follows_setpoints(Dialect dialect, const mavlink::Heartbeat& heartbeat) noexcept;
/// Enters the mode. @pre rules(dialect).mode_name is not empty
mavlink::CommandLong mode_command(Dialect dialect) noexcept;
mavlink::CommandLong arm_command(bool arm, bool force) noexcept;

/// A parameter's number, as this dialect has it in a message; NaN for a type that is not known.
double parameter_value(Dialect dialect, const mavlink::ParamValue& parameter) noexcept;
/// The message's value for a number of the parameter's type.
float encoded_parameter(Dialect dialect, double value, std::uint8_t type) noexcept;

/// What its failsafe does when setpoints stop, by the parameters that were read (NaN: was not).
/// PX4: COM_OF_LOSS_T at most 2 s, COM_OBL_RC_ACT anything but 5 (hold, which ends with the battery).
/// ArduPilot: GUID_TIMEOUT at most 5 s and FS_GCS_ENABLE not 0: it levels, and lands when our heartbeats are gone.
flight::FirmwareFailsafe failsafe_of(Dialect dialect, double timeout_s, double action) noexcept;

}  // namespace gatefield::bridge
