#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <variant>

#include "client/firmware/mavlink/messages_command.h"
#include "client/firmware/mavlink/messages_hil.h"
#include "client/firmware/mavlink/messages_link.h"
#include "client/firmware/mavlink/messages_state.h"
#include "common/base/result.h"

/// All messages that are known here.
namespace gatefield::firmware::mavlink {

using Message = std::variant<Heartbeat, SysStatus, SystemTime, SetMode, ParamRequestRead, ParamValue, ParamSet,
                             Attitude, AttitudeQuaternion, LocalPositionNed, RcChannels, CommandLong, CommandAck,
                             SetAttitudeTarget, HilActuatorControls, HighresImu, HilSensor, Timesync, HilGps,
                             HilStateQuaternion, BatteryStatus, ExtendedSysState, StatusText, Odometry>;

/// What is known of a message without its content.
struct Definition {
  std::uint32_t id = 0;
  std::string_view name;
  std::uint8_t crc_extra = 0;
  std::uint8_t base_length = 0;     ///< without extensions
  std::uint8_t payload_length = 0;  ///< with them
};

/// Of all messages, by rising id. Thread-safe: yes.   Real-time safe: yes.
const std::array<Definition, std::variant_size_v<Message>>& definitions() noexcept;
/// Null: no message with that id is known. Thread-safe: yes.   Real-time safe: yes.
const Definition* find_definition(std::uint32_t id) noexcept;

/// What is wrong with a message, without words.
struct Fault {
  std::string_view message;           ///< kName
  std::string_view field;             ///< its first wrong field
  int index = -1;                     ///< of an array's wrong element; -1: no array, or all of it
  double value = 0.0;                 ///< of the number; texts have none
  std::array<float, 4> quaternion{};  ///< of a quaternion of another length
  Allowed allowed;
};

/// Holds a message's values against what its table allows, and ATTITUDE_QUATERNION's four numbers against length 1.
/// Thread-safe: yes.   Real-time safe: yes.
std::optional<Fault> find_fault(const Message& message) noexcept;

/// The fault in words: kInvalid with "NAME.field" as field ("ODOMETRY.q", "SET_ATTITUDE_TARGET.thrust",
/// "HIL_ACTUATOR_CONTROLS.controls[3]"), its value and what is allowed.
Error describe(const Fault& fault);

/// Both of them. Real-time safe: where it succeeds.
Status validate(const Message& message);

}  // namespace gatefield::firmware::mavlink
