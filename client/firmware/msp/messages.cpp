#include "client/firmware/msp/messages.h"

#include <algorithm>
#include <numbers>

namespace gatefield::firmware::msp {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kCountsPerDegreeASecond = 16.4;

/// Reads a payload field by field; beyond its end everything is 0 and ok() false.
class Fields {
 public:
  explicit Fields(Payload payload) noexcept : payload_(payload) {}

  std::uint8_t u8() noexcept {
    if (at_ >= payload_.size()) {
      ok_ = false;
      return 0;
    }
    return payload_[at_++];
  }
  std::uint16_t u16() noexcept {
    const unsigned low = u8();
    return static_cast<std::uint16_t>(low | static_cast<unsigned>(u8()) << 8);
  }
  std::int16_t i16() noexcept { return static_cast<std::int16_t>(u16()); }
  std::uint32_t u32() noexcept {
    const std::uint32_t low = u16();
    return low | static_cast<std::uint32_t>(u16()) << 16;
  }
  void skip(std::size_t bytes) noexcept {
    for (std::size_t i = 0; i < bytes; ++i) u8();
  }
  std::size_t left() const noexcept { return payload_.size() - at_; }
  bool ok() const noexcept { return ok_; }

 private:
  Payload payload_;
  std::size_t at_ = 0;
  bool ok_ = true;
};

template <std::size_t kCount>
void put(std::array<std::uint8_t, kCount>& bytes, std::size_t place, std::uint16_t value) noexcept {
  bytes[2 * place] = static_cast<std::uint8_t>(value);
  bytes[2 * place + 1] = static_cast<std::uint8_t>(value >> 8);
}

}  // namespace

std::optional<ApiVersion> read_api_version(Payload payload) noexcept {
  Fields fields(payload);
  fields.skip(1);
  const ApiVersion version{fields.u8(), fields.u8()};
  return fields.ok() ? std::optional(version) : std::nullopt;
}

std::string read_variant(Payload payload) {
  constexpr std::size_t kLetters = 4;
  if (payload.size() < kLetters) return {};
  std::string letters(payload.begin(), payload.begin() + kLetters);
  return std::all_of(letters.begin(), letters.end(), [](char c) { return c > ' ' && c <= '~'; }) ? letters
                                                                                                 : std::string();
}

std::optional<FirmwareVersion> read_firmware_version(Payload payload) noexcept {
  constexpr int kFirstYear = 25;  // versions were 4.5 before
  Fields fields(payload);
  FirmwareVersion version{fields.u8(), fields.u8(), fields.u8()};
  if (version.major >= kFirstYear) version.major += 2000;
  return fields.ok() ? std::optional(version) : std::nullopt;
}

std::optional<Status> read_status(Payload payload) noexcept {
  Fields fields(payload);
  Status status;
  status.cycle_time_us = fields.u16();
  fields.skip(2);
  status.sensors = fields.u16();
  status.modes = fields.u32();
  fields.skip(1);
  status.load_percent = fields.u16();
  fields.skip(2);
  fields.skip(fields.u8() & 0x0Fu);
  const int reasons = fields.u8();  // the last one is the arm switch itself
  status.arming_disabled = fields.u32();
  if (reasons < 1 || reasons > 32) return std::nullopt;
  const std::uint32_t arm_switch = 1u << (reasons - 1);
  status.arm_switch_waits = (status.arming_disabled & arm_switch) != 0;
  status.arming_disabled &= ~arm_switch;
  return fields.ok() ? std::optional(status) : std::nullopt;
}

const char* why_not_armed(int bit) noexcept {
  static constexpr std::array kReasons{
      "no gyro was found: the board is broken, or has the wrong firmware",
      "the receiver is in failsafe: the flight controller hears no channels; look at receiver and feature "
      "RX_MSP",
      "the receiver is in failsafe: the flight controller hears no channels; look at receiver and feature "
      "RX_MSP",
      "the arm switch was on when the receiver was found: switch it off and on again",
      "the failsafe switch is on: switch it off",
      "it stopped itself at take-off (runaway take-off): look at motor order and propellers, then arm again",
      "it found a crash: disarm, look at the vehicle, arm again",
      "the throttle is not low: pull it below min_check",
      "it is not level: put it on level ground, or raise small_angle",
      "it has just started: wait some seconds",
      "the prearm switch is off: switch it on",
      "its processor is overloaded: lower the rate of the PID loop",
      "it calibrates its sensors: keep it still",
      "its command line is open: type exit there, or close the configurator",
      "its menu on the screen is open: leave it",
      "the BST bus does not let it arm",
      "a configurator does not let it arm: close it, or switch arming on in its motors tab",
      "the paralyse switch was used: power it off and on",
      "it waits for GPS: set gps_rescue_allow_arming_without_fix = ON, if GPS is not used",
      "the GPS rescue switch is on: switch it off",
      "the motors' telemetry is missing: look at the ESCs' firmware, or set dshot_bidir = OFF",
      "it must be restarted after a change of settings: power it off and on",
      "DSHOT bitbang has a fault: set dshot_bitbang = OFF",
      "its accelerometer is not calibrated: calibrate it in the configurator",
      "no motor protocol is chosen: set motor_pwm_protocol"};
  return bit >= 0 && static_cast<std::size_t>(bit) < kReasons.size()
             ? kReasons[static_cast<std::size_t>(bit)]
             : "a mode is switched on with which it does not arm: switch all modes off but the arm switch";
}

std::optional<Attitude> read_attitude(Payload payload) noexcept {
  Fields fields(payload);
  const int roll = fields.i16(), pitch = fields.i16(), yaw = fields.i16();
  if (!fields.ok() || std::abs(roll) > 1800 || std::abs(pitch) > 900 || yaw < 0 || yaw > 360) return std::nullopt;
  return Attitude{roll * 0.1 * kDegree, -pitch * 0.1 * kDegree, yaw * kDegree};
}

std::optional<RawImu> read_raw_imu(Payload payload) noexcept {
  Fields fields(payload);
  RawImu imu;
  for (double& axis : imu.acceleration) axis = fields.i16();
  for (double& axis : imu.gyro_rad_s) axis = fields.i16() * kDegree / kCountsPerDegreeASecond;
  return fields.ok() ? std::optional(imu) : std::nullopt;
}

std::optional<Battery> read_battery(Payload payload) noexcept {
  Fields fields(payload);
  Battery battery;
  battery.cells = fields.u8();
  fields.skip(3);
  battery.drawn_ah = fields.u16() * 1e-3;
  battery.current_a = fields.i16() * 1e-2;
  const std::uint8_t state = fields.u8();
  battery.voltage_v = fields.u16() * 1e-2;
  if (!fields.ok() || state > static_cast<std::uint8_t>(Battery::State::kNotMeasured)) return std::nullopt;
  battery.state = static_cast<Battery::State>(state);
  return battery;
}

std::optional<Channels> read_rc(Payload payload) noexcept {
  Fields fields(payload);
  Channels channels;
  while (channels.count < kMaxChannels && fields.left() >= 2) channels.microseconds[channels.count++] = fields.u16();
  return channels.count >= 4 ? std::optional(channels) : std::nullopt;
}

std::optional<Motors> read_motors(Payload payload) noexcept {
  Fields fields(payload);
  Motors motors{};
  for (std::uint16_t& motor : motors) {
    motor = fields.u16();
    if (motor > 2100) return std::nullopt;
  }
  return fields.ok() ? std::optional(motors) : std::nullopt;
}

std::optional<RcTuning> read_rc_tuning(Payload payload) noexcept {
  constexpr int kRoll = 0, kPitch = 1, kYaw = 2;
  Fields fields(payload);
  RcTuning tuning;
  tuning.axes[kRoll].rc_rate = fields.u8();
  tuning.axes[kRoll].expo = fields.u8();
  for (auto& axis : tuning.axes) axis.super_rate = fields.u8();
  fields.skip(1);
  tuning.throttle_mid = fields.u8();
  tuning.throttle_expo = fields.u8();
  fields.skip(2);
  tuning.axes[kYaw].expo = fields.u8();
  tuning.axes[kYaw].rc_rate = fields.u8();
  tuning.axes[kPitch].rc_rate = fields.u8();
  tuning.axes[kPitch].expo = fields.u8();
  const std::uint8_t limit = fields.u8();
  tuning.throttle_limit_percent = fields.u8();
  for (auto& axis : tuning.axes) axis.limit_deg_s = fields.u16();
  const std::uint8_t type = fields.u8();
  bool possible = fields.ok() && limit <= 2 && type <= 4 && tuning.throttle_mid <= 100 && tuning.throttle_expo <= 100 &&
                  tuning.throttle_limit_percent >= 1 && tuning.throttle_limit_percent <= 100;
  for (const auto& axis : tuning.axes)
    possible &= axis.limit_deg_s >= 1 && axis.limit_deg_s <= 1998 && axis.expo <= 100;
  if (!possible) return std::nullopt;
  tuning.throttle_limit = static_cast<RcTuning::ThrottleLimit>(limit);
  tuning.type = static_cast<RcTuning::RatesType>(type);
  return tuning;
}

std::optional<RxConfig> read_rx_config(Payload payload) noexcept {
  Fields fields(payload);
  RxConfig config;
  fields.skip(1);
  config.max_check = fields.u16();
  config.mid = fields.u16();
  config.min_check = fields.u16();
  fields.skip(1);
  config.shortest = fields.u16();
  config.longest = fields.u16();
  const bool possible = fields.ok() && config.mid >= 1200 && config.mid <= 1700 && config.min_check >= 750 &&
                        config.min_check < config.max_check && config.max_check <= 2250 && config.shortest >= 750 &&
                        config.shortest < config.longest && config.longest <= 2250 && config.min_check < 2000;
  return possible ? std::optional(config) : std::nullopt;
}

std::optional<RxMap> read_rx_map(Payload payload) noexcept {
  RxMap map{};
  if (payload.size() < map.size()) return std::nullopt;
  std::copy_n(payload.begin(), map.size(), map.begin());
  unsigned taken = 0;
  for (const std::uint8_t place : map) taken |= place < map.size() ? 1u << place : 0u;
  return taken == 0xFF ? std::optional(map) : std::nullopt;  // each place once
}

std::optional<RcDeadband> read_rc_deadband(Payload payload) noexcept {
  Fields fields(payload);
  const RcDeadband deadband{fields.u8(), fields.u8()};
  return fields.ok() && deadband.roll_pitch <= 100 && deadband.yaw <= 100 ? std::optional(deadband) : std::nullopt;
}

std::optional<Failsafe> read_failsafe(Payload payload) noexcept {
  Fields fields(payload);
  Failsafe failsafe;
  failsafe.delay_s = fields.u8() * 0.1;
  fields.skip(1);
  failsafe.throttle = fields.u16();
  fields.skip(3);
  const std::uint8_t procedure = fields.u8();
  if (!fields.ok() || procedure > 2) return std::nullopt;
  failsafe.procedure = static_cast<Failsafe::Procedure>(procedure);
  return failsafe;
}

std::optional<ModeRanges> read_mode_ranges(Payload payload) noexcept {
  constexpr int kFrom = 900, kStep = 25;
  if (payload.size() % 4 != 0) return std::nullopt;
  Fields fields(payload);
  ModeRanges found;
  while (fields.left() >= 4 && found.count < kMaxModeRanges) {
    ModeRange range;
    range.mode = fields.u8();
    range.aux = fields.u8();
    range.begin_us = kFrom + kStep * fields.u8();
    range.end_us = kFrom + kStep * fields.u8();
    if (range.begin_us < range.end_us) found.ranges[found.count++] = range;
  }
  return found;
}

std::vector<std::uint8_t> read_box_ids(Payload payload) { return {payload.begin(), payload.end()}; }

std::optional<std::uint32_t> read_features(Payload payload) noexcept {
  Fields fields(payload);
  const std::uint32_t features = fields.u32();
  return fields.ok() ? std::optional(features) : std::nullopt;
}

std::optional<Mixer> read_mixer(Payload payload) noexcept {
  Fields fields(payload);
  const Mixer mixer{fields.u8(), fields.u8() != 0};
  return fields.ok() ? std::optional(mixer) : std::nullopt;
}

std::array<std::uint8_t, 2 * kMaxChannels> raw_rc(const std::array<std::uint16_t, kMaxChannels>& channels) noexcept {
  std::array<std::uint8_t, 2 * kMaxChannels> bytes{};
  for (std::size_t i = 0; i < channels.size(); ++i) put(bytes, i, channels[i]);
  return bytes;
}

std::array<std::uint8_t, 16> set_motor(const Motors& microseconds) noexcept {
  std::array<std::uint8_t, 16> bytes{};
  for (std::size_t i = 0; i < microseconds.size(); ++i) put(bytes, i, microseconds[i]);
  return bytes;
}

}  // namespace gatefield::firmware::msp
