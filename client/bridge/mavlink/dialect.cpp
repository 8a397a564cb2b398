#include "client/bridge/mavlink/dialect.h"

#include <bit>
#include <cmath>
#include <limits>

namespace gatefield::bridge {
namespace {

using flight::FirmwareFailsafe;
using mavlink::ParameterType;
using Use = ParameterRule::Use;

constexpr std::array kPx4Parameters{ParameterRule{"COM_OF_LOSS_T", Use::kTimeout},
                                    ParameterRule{"COM_OBL_RC_ACT", Use::kAction}};
constexpr std::array kArduPilotParameters{ParameterRule{"GUID_OPTIONS", Use::kThrustBit},
                                          ParameterRule{"GUID_TIMEOUT", Use::kTimeout},
                                          ParameterRule{"FS_GCS_ENABLE", Use::kAction}};

constexpr DialectRules kPx4{
    "PX4", mavlink::AutopilotKind::kPx4, "PX4", "OFFBOARD", mavlink::kPx4Offboard, kPx4Parameters, true};
constexpr DialectRules kArduPilot{"ARDUPILOT", mavlink::AutopilotKind::kArduPilot, "ArduPilot",
                                  "GUIDED",    mavlink::kArduCopterGuided,         kArduPilotParameters,
                                  false};
constexpr DialectRules kPlain{"PLAIN", std::nullopt, "any autopilot", {}, 0, {}, false};

constexpr double kPx4Hold = 5;

}  // namespace

const DialectRules& rules(Dialect dialect) noexcept {
  switch (dialect) {
    case Dialect::kPx4:
      return kPx4;
    case Dialect::kArduPilot:
      return kArduPilot;
    case Dialect::kPlain:
      break;
  }
  return kPlain;
}

bool follows_setpoints(Dialect dialect, const mavlink::Heartbeat& heartbeat) noexcept {
  const bool custom = (heartbeat.base_mode & mavlink::kModeCustom) != 0;
  switch (dialect) {
    case Dialect::kPx4:
      return custom && (heartbeat.custom_mode >> 16 & 0xFF) == mavlink::kPx4Offboard;
    case Dialect::kArduPilot:
      return custom && heartbeat.custom_mode == mavlink::kArduCopterGuided;
    case Dialect::kPlain:
      break;
  }
  return (heartbeat.base_mode & mavlink::kModeArmed) != 0;
}

mavlink::CommandLong mode_command(Dialect dialect) noexcept {
  mavlink::CommandLong command;
  command.command = static_cast<std::uint16_t>(mavlink::Command::kDoSetMode);
  command.param1 = mavlink::kModeCustom;
  command.param2 = rules(dialect).mode_number;
  return command;
}

mavlink::CommandLong arm_command(bool arm, bool force) noexcept {
  mavlink::CommandLong command;
  command.command = static_cast<std::uint16_t>(mavlink::Command::kArmDisarm);
  command.param1 = arm ? 1.0F : 0.0F;
  command.param2 = force ? mavlink::kForceDisarm : 0.0F;
  return command;
}

double parameter_value(Dialect dialect, const mavlink::ParamValue& parameter) noexcept {
  const auto type = static_cast<ParameterType>(parameter.param_type);
  if (type == ParameterType::kFloat || !rules(dialect).integers_as_bytes)
    return static_cast<double>(parameter.param_value);
  const auto bits = std::bit_cast<std::uint32_t>(parameter.param_value);
  switch (type) {
    case ParameterType::kUint8:
      return static_cast<std::uint8_t>(bits);
    case ParameterType::kInt8:
      return static_cast<std::int8_t>(bits);
    case ParameterType::kUint16:
      return static_cast<std::uint16_t>(bits);
    case ParameterType::kInt16:
      return static_cast<std::int16_t>(bits);
    case ParameterType::kUint32:
      return bits;
    case ParameterType::kInt32:
      return static_cast<std::int32_t>(bits);
    default:
      return std::numeric_limits<double>::quiet_NaN();
  }
}

float encoded_parameter(Dialect dialect, double value, std::uint8_t type) noexcept {
  if (static_cast<ParameterType>(type) == ParameterType::kFloat || !rules(dialect).integers_as_bytes)
    return static_cast<float>(value);
  return std::bit_cast<float>(static_cast<std::uint32_t>(static_cast<std::int64_t>(value)));
}

FirmwareFailsafe failsafe_of(Dialect dialect, double timeout_s, double action) noexcept {
  if (dialect == Dialect::kPlain || std::isnan(timeout_s) || std::isnan(action)) return FirmwareFailsafe::kNotChecked;
  const bool good = dialect == Dialect::kPx4 ? timeout_s <= 2.0 && action != kPx4Hold : timeout_s <= 5.0 && action != 0;
  return good ? FirmwareFailsafe::kGood : FirmwareFailsafe::kBad;
}

}  // namespace gatefield::bridge
