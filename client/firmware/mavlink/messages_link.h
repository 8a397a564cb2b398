#pragma once

#include <array>
#include <cstdint>

#include "client/firmware/mavlink/field.h"

/// Messages about the link and the vehicle as a whole. Names of fields are those of the definitions (mavlink.io,
/// "MAVLINK common message set"), which their comments repeat in short.
namespace gatefield::firmware::mavlink {

/// Who I am and how I am; at least once a second, by everybody.
struct Heartbeat {
  static constexpr std::uint32_t kId = 0;
  static constexpr std::string_view kName = "HEARTBEAT";
  std::uint32_t custom_mode = 0;     ///< the autopilot's own
  std::uint8_t type = 0;             ///< VehicleType
  std::uint8_t autopilot = 0;        ///< AutopilotKind
  std::uint8_t base_mode = 0;        ///< bits kMode...
  std::uint8_t system_status = 0;    ///< SystemStatus
  std::uint8_t mavlink_version = 3;  ///< of the protocol
  static constexpr auto fields() {
    return std::tuple{
        field("custom_mode", &Heartbeat::custom_mode),     field("type", &Heartbeat::type),
        field("autopilot", &Heartbeat::autopilot),         field("base_mode", &Heartbeat::base_mode),
        field("system_status", &Heartbeat::system_status), field("mavlink_version", &Heartbeat::mavlink_version)};
  }
};

/// Sensors and battery in short.
struct SysStatus {
  static constexpr std::uint32_t kId = 1;
  static constexpr std::string_view kName = "SYS_STATUS";
  std::uint32_t onboard_control_sensors_present = 0;
  std::uint32_t onboard_control_sensors_enabled = 0;
  std::uint32_t onboard_control_sensors_health = 0;
  std::uint16_t load = 0;                  ///< of the main loop, 0.1 %
  std::uint16_t voltage_battery = 0xFFFF;  ///< mV; 0xFFFF: not known
  std::int16_t current_battery = -1;       ///< 10 mA; -1: not known
  std::uint16_t drop_rate_comm = 0;        ///< 0.01 %
  std::uint16_t errors_comm = 0;
  std::uint16_t errors_count1 = 0;
  std::uint16_t errors_count2 = 0;
  std::uint16_t errors_count3 = 0;
  std::uint16_t errors_count4 = 0;
  std::int8_t battery_remaining = -1;  ///< %; -1: not known
  std::uint32_t onboard_control_sensors_present_extended = 0;
  std::uint32_t onboard_control_sensors_enabled_extended = 0;
  std::uint32_t onboard_control_sensors_health_extended = 0;
  static constexpr auto fields() {
    return std::tuple{
        field("onboard_control_sensors_present", &SysStatus::onboard_control_sensors_present),
        field("onboard_control_sensors_enabled", &SysStatus::onboard_control_sensors_enabled),
        field("onboard_control_sensors_health", &SysStatus::onboard_control_sensors_health),
        field("load", &SysStatus::load),
        field("voltage_battery", &SysStatus::voltage_battery),
        field("current_battery", &SysStatus::current_battery),
        field("drop_rate_comm", &SysStatus::drop_rate_comm),
        field("errors_comm", &SysStatus::errors_comm),
        field("errors_count1", &SysStatus::errors_count1),
        field("errors_count2", &SysStatus::errors_count2),
        field("errors_count3", &SysStatus::errors_count3),
        field("errors_count4", &SysStatus::errors_count4),
        field("battery_remaining", &SysStatus::battery_remaining, within(-1, 100, "%")),
        extension("onboard_control_sensors_present_extended", &SysStatus::onboard_control_sensors_present_extended),
        extension("onboard_control_sensors_enabled_extended", &SysStatus::onboard_control_sensors_enabled_extended),
        extension("onboard_control_sensors_health_extended", &SysStatus::onboard_control_sensors_health_extended)};
  }
};

/// The sender's clocks, read at once.
struct SystemTime {
  static constexpr std::uint32_t kId = 2;
  static constexpr std::string_view kName = "SYSTEM_TIME";
  std::uint64_t time_unix_usec = 0;  ///< since 1970, us; 0: not known
  std::uint32_t time_boot_ms = 0;    ///< since boot, ms
  static constexpr auto fields() {
    return std::tuple{field("time_unix_usec", &SystemTime::time_unix_usec),
                      field("time_boot_ms", &SystemTime::time_boot_ms)};
  }
};

/// Clocks compared: who asks sends tc1 = 0 and its own time as ts1; the answer has the other's time as tc1 and ts1 as
/// it came.
struct Timesync {
  static constexpr std::uint32_t kId = 111;
  static constexpr std::string_view kName = "TIMESYNC";
  std::int64_t tc1 = 0;               ///< ns
  std::int64_t ts1 = 0;               ///< ns
  std::uint8_t target_system = 0;     ///< 0: everybody; in answers of PX4 up to 1.16 anybody
  std::uint8_t target_component = 0;  ///< 0: everybody
  static constexpr auto fields() {
    return std::tuple{field("tc1", &Timesync::tc1), field("ts1", &Timesync::ts1),
                      extension("target_system", &Timesync::target_system),
                      extension("target_component", &Timesync::target_component)};
  }
};

/// A battery.
struct BatteryStatus {
  static constexpr std::uint32_t kId = 147;
  static constexpr std::string_view kName = "BATTERY_STATUS";
  std::int32_t current_consumed = -1;  ///< mAh; -1: not known
  std::int32_t energy_consumed = -1;   ///< 100 J; -1: not known
  std::int16_t temperature = 0x7FFF;   ///< 0.01 degrees Celsius; 0x7FFF: not known
  /// mV of each cell, 0xFFFF for cells that are not there. Senders that know the sum alone put it into the first, and
  /// what doesn't fit there into the next ones.
  std::array<std::uint16_t, 10> voltages{0xFFFF, 0xFFFF, 0xFFFF, 0xFFFF, 0xFFFF,
                                         0xFFFF, 0xFFFF, 0xFFFF, 0xFFFF, 0xFFFF};
  std::int16_t current_battery = -1;  ///< 10 mA; -1: not known
  std::uint8_t id = 0;
  std::uint8_t battery_function = 0;
  std::uint8_t type = 0;
  std::int8_t battery_remaining = -1;  ///< %; -1: not known
  std::int32_t time_remaining = 0;     ///< s; 0: not known
  std::uint8_t charge_state = 0;
  std::array<std::uint16_t, 4> voltages_ext{};  ///< mV of cells 11 to 14; 0: not there
  std::uint8_t mode = 0;
  std::uint32_t fault_bitmask = 0;
  static constexpr auto fields() {
    return std::tuple{field("current_consumed", &BatteryStatus::current_consumed),
                      field("energy_consumed", &BatteryStatus::energy_consumed),
                      field("temperature", &BatteryStatus::temperature),
                      field("voltages", &BatteryStatus::voltages),
                      field("current_battery", &BatteryStatus::current_battery),
                      field("id", &BatteryStatus::id),
                      field("battery_function", &BatteryStatus::battery_function),
                      field("type", &BatteryStatus::type),
                      field("battery_remaining", &BatteryStatus::battery_remaining, within(-1, 100, "%")),
                      extension("time_remaining", &BatteryStatus::time_remaining),
                      extension("charge_state", &BatteryStatus::charge_state),
                      extension("voltages_ext", &BatteryStatus::voltages_ext),
                      extension("mode", &BatteryStatus::mode),
                      extension("fault_bitmask", &BatteryStatus::fault_bitmask)};
  }
};

/// What the person's radio says, us of each channel; 0xFFFF: no such channel.
struct RcChannels {
  static constexpr std::uint32_t kId = 65;
  static constexpr std::string_view kName = "RC_CHANNELS";
  static constexpr std::size_t kChannels = 18;
  std::uint32_t time_boot_ms = 0;
  std::uint16_t chan1_raw = 0xFFFF, chan2_raw = 0xFFFF, chan3_raw = 0xFFFF, chan4_raw = 0xFFFF, chan5_raw = 0xFFFF,
                chan6_raw = 0xFFFF, chan7_raw = 0xFFFF, chan8_raw = 0xFFFF, chan9_raw = 0xFFFF, chan10_raw = 0xFFFF,
                chan11_raw = 0xFFFF, chan12_raw = 0xFFFF, chan13_raw = 0xFFFF, chan14_raw = 0xFFFF, chan15_raw = 0xFFFF,
                chan16_raw = 0xFFFF, chan17_raw = 0xFFFF, chan18_raw = 0xFFFF;
  std::uint8_t chancount = 0;  ///< how many of them mean something; 0: the radio is not heard
  std::uint8_t rssi = 0xFF;    ///< 0 to 254; 0xFF: not known
  static constexpr auto fields() {
    return std::tuple{field("time_boot_ms", &RcChannels::time_boot_ms),
                      field("chan1_raw", &RcChannels::chan1_raw),
                      field("chan2_raw", &RcChannels::chan2_raw),
                      field("chan3_raw", &RcChannels::chan3_raw),
                      field("chan4_raw", &RcChannels::chan4_raw),
                      field("chan5_raw", &RcChannels::chan5_raw),
                      field("chan6_raw", &RcChannels::chan6_raw),
                      field("chan7_raw", &RcChannels::chan7_raw),
                      field("chan8_raw", &RcChannels::chan8_raw),
                      field("chan9_raw", &RcChannels::chan9_raw),
                      field("chan10_raw", &RcChannels::chan10_raw),
                      field("chan11_raw", &RcChannels::chan11_raw),
                      field("chan12_raw", &RcChannels::chan12_raw),
                      field("chan13_raw", &RcChannels::chan13_raw),
                      field("chan14_raw", &RcChannels::chan14_raw),
                      field("chan15_raw", &RcChannels::chan15_raw),
                      field("chan16_raw", &RcChannels::chan16_raw),
                      field("chan17_raw", &RcChannels::chan17_raw),
                      field("chan18_raw", &RcChannels::chan18_raw),
                      field("chancount", &RcChannels::chancount, within(0, kChannels)),
                      field("rssi", &RcChannels::rssi)};
  }
  /// The channels in a row.
  std::array<std::uint16_t, kChannels> channels() const noexcept {
    return {chan1_raw,  chan2_raw,  chan3_raw,  chan4_raw,  chan5_raw,  chan6_raw,  chan7_raw,  chan8_raw,  chan9_raw,
            chan10_raw, chan11_raw, chan12_raw, chan13_raw, chan14_raw, chan15_raw, chan16_raw, chan17_raw, chan18_raw};
  }
};

/// Whether it stands on the ground.
struct ExtendedSysState {
  static constexpr std::uint32_t kId = 245;
  static constexpr std::string_view kName = "EXTENDED_SYS_STATE";
  std::uint8_t vtol_state = 0;
  std::uint8_t landed_state = 0;  ///< LandedState
  static constexpr auto fields() {
    return std::tuple{field("vtol_state", &ExtendedSysState::vtol_state),
                      field("landed_state", &ExtendedSysState::landed_state)};
  }
};

/// Words for people.
struct StatusText {
  static constexpr std::uint32_t kId = 253;
  static constexpr std::string_view kName = "STATUSTEXT";
  std::uint8_t severity = 6;    ///< Severity
  std::array<char, 50> text{};  ///< up to the first NUL, if there is one
  std::uint16_t id = 0;         ///< of a text in several messages; 0: this is all of it
  std::uint8_t chunk_seq = 0;   ///< which part of it
  static constexpr auto fields() {
    return std::tuple{field("severity", &StatusText::severity, within(0, 7)),
                      field("text", &StatusText::text, printable()), extension("id", &StatusText::id),
                      extension("chunk_seq", &StatusText::chunk_seq)};
  }
};

}  // namespace gatefield::firmware::mavlink
