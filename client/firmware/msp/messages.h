#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <tuple>
#include <vector>

/// The messages of MSP that a bridge needs, as numbers of our own units. Layouts are those of Betaflight 4.4 (API 1.45)
/// to 2026.6 (1.48): later versions only append, so what follows the fields read here is ignored, and a payload that is
/// too short for them, or a value that can't be, gives nothing.
/// Thread-safe: yes.   Real-time safe: all but read_variant() and read_box_ids(), which allocate.
namespace gatefield::firmware::msp {

namespace command {
inline constexpr std::uint16_t kApiVersion = 1;
inline constexpr std::uint16_t kFcVariant = 2;
inline constexpr std::uint16_t kFcVersion = 3;
inline constexpr std::uint16_t kModeRanges = 34;
inline constexpr std::uint16_t kFeatureConfig = 36;
inline constexpr std::uint16_t kMixerConfig = 42;
inline constexpr std::uint16_t kRxConfig = 44;
inline constexpr std::uint16_t kRxMap = 64;
inline constexpr std::uint16_t kFailsafeConfig = 75;
inline constexpr std::uint16_t kStatus = 101;
inline constexpr std::uint16_t kRawImu = 102;
inline constexpr std::uint16_t kMotor = 104;
inline constexpr std::uint16_t kRc = 105;
inline constexpr std::uint16_t kAttitude = 108;
inline constexpr std::uint16_t kAnalog = 110;
inline constexpr std::uint16_t kRcTuning = 111;
inline constexpr std::uint16_t kBoxIds = 119;
inline constexpr std::uint16_t kRcDeadband = 125;
inline constexpr std::uint16_t kBatteryState = 130;
inline constexpr std::uint16_t kStatusEx = 150;
inline constexpr std::uint16_t kSetRawRc = 200;
inline constexpr std::uint16_t kSetMotor = 214;
}  // namespace command

using Payload = std::span<const std::uint8_t>;

/// kApiVersion: u8 protocol, u8 major, u8 minor.
struct ApiVersion {
  int major = 0, minor = 0;
};
std::optional<ApiVersion> read_api_version(Payload payload) noexcept;

/// kFcVariant: four letters; "BTFL" is Betaflight. Empty: not four printable letters.
std::string read_variant(Payload payload);

/// kFcVersion: three u8. Until 4.5 major, minor, patch; since 2025.12 years since 2000, month, patch.
struct FirmwareVersion {
  int major = 0, minor = 0, patch = 0;
  friend bool operator==(const FirmwareVersion&, const FirmwareVersion&) = default;
  friend bool operator<(const FirmwareVersion& a, const FirmwareVersion& b) noexcept {
    return std::tie(a.major, a.minor, a.patch) < std::tie(b.major, b.minor, b.patch);
  }
};
/// Versions of years are given as years: 2025, 12, 1.
std::optional<FirmwareVersion> read_firmware_version(Payload payload) noexcept;

/// kStatus, kStatusEx: u16 cycle time, u16 bus errors, u16 sensors, u32 modes that are on (bit: place of the mode in
/// kBoxIds), u8 profile, u16 load, two bytes or one and one, u8 count of further bytes of modes (low 4 bits), these
/// bytes, u8 count of arming flags, u32 reasons not to arm, u8 configuration state (bit 0: it must restart).
struct Status {
  int cycle_time_us = 0;
  std::uint16_t sensors = 0;  ///< bit 0 accelerometer, 5 gyro
  std::uint32_t modes = 0;    ///< the first 32
  int load_percent = 0;
  std::uint32_t arming_disabled = 0;  ///< why it does not arm: a bit for each reason; 0: it would
  bool arm_switch_waits = false;      ///< the arm switch is on while there are reasons: it must go off first
};
std::optional<Status> read_status(Payload payload) noexcept;

/// What a reason means and what to do, for the person in front of it; `bit` of Status::arming_disabled, from 0. The
/// first 25 are the same from 4.4 on; what follows are switches of modes.
const char* why_not_armed(int bit) noexcept;
inline constexpr int kNotArmedThrottle = 7, kNotArmedRxFailsafe = 2, kNotArmedCli = 13;

/// kAttitude: i16 roll and pitch in tenths of a degree, i16 yaw in degrees (0 to 359, clockwise from where it was
/// switched on, or from north with a magnetometer). On the wire roll is positive to the right and pitch nose
/// down; here pitch is positive nose up, as in aviation.
struct Attitude {
  double roll_rad = 0.0, pitch_rad = 0.0, yaw_rad = 0.0;  ///< FRD against NED, whose north may be arbitrary
};
std::optional<Attitude> read_attitude(Payload payload) noexcept;

/// kRawImu: i16 accelerometer (in units that depend on the sensor), i16 gyro (16.4 counts per deg/s: sensors of 2000
/// deg/s), i16 magnetometer; x, y, z each, as the firmware holds them: FLU.
struct RawImu {
  std::array<double, 3> acceleration{};  ///< counts
  std::array<double, 3> gyro_rad_s{};
};
std::optional<RawImu> read_raw_imu(Payload payload) noexcept;

/// kBatteryState: u8 cells (0: none connected), u16 capacity mAh, u8 tenths of a volt, u16 mAh drawn, i16 hundredths of
/// an ampere, u8 state (0 fine, 1 warning, 2 critical, 3 not there, 4 not measured), u16 hundredths of a volt.
struct Battery {
  int cells = 0;
  double voltage_v = 0.0, current_a = 0.0, drawn_ah = 0.0;
  enum class State : std::uint8_t { kFine = 0, kWarning = 1, kCritical = 2, kNotThere = 3, kNotMeasured = 4 };
  State state = State::kNotMeasured;
};
std::optional<Battery> read_battery(Payload payload) noexcept;

inline constexpr std::size_t kMaxChannels = 18;

/// kRc: u16 each, microseconds, in the order roll, pitch, yaw, throttle, AUX1, ...
struct Channels {
  std::size_t count = 0;
  std::array<std::uint16_t, kMaxChannels> microseconds{};
};
std::optional<Channels> read_rc(Payload payload) noexcept;

/// kMotor: eight u16, as pulses of 1000 (still) to 2000 microseconds; 0: no such motor.
using Motors = std::array<std::uint16_t, 8>;
std::optional<Motors> read_motors(Payload payload) noexcept;

/// kRcTuning: u8 rc_rate roll, u8 expo roll, u8 super rate roll, pitch, yaw, u8 0, u8 throttle mid, u8 throttle expo,
/// u16 0, u8 expo yaw, u8 rc_rate yaw, u8 rc_rate pitch, u8 expo pitch, u8 throttle limit type, u8 its percent, u16
/// limit of roll, pitch, yaw in deg/s, u8 type of rates.
struct RcTuning {
  enum class RatesType : std::uint8_t { kBetaflight = 0, kRaceflight = 1, kKiss = 2, kActual = 3, kQuick = 4 };
  struct Axis {
    int rc_rate = 0, super_rate = 0, expo = 0;
    int limit_deg_s = 0;
  };
  RatesType type = RatesType::kActual;
  std::array<Axis, 3> axes{};  ///< roll, pitch, yaw
  int throttle_mid = 50, throttle_expo = 0;
  enum class ThrottleLimit : std::uint8_t { kOff = 0, kScale = 1, kClip = 2 };
  ThrottleLimit throttle_limit = ThrottleLimit::kOff;
  int throttle_limit_percent = 100;
};
std::optional<RcTuning> read_rc_tuning(Payload payload) noexcept;

/// kRxConfig: u8 serial provider, u16 max_check, u16 mid_rc, u16 min_check, u8 bind, u16 shortest and u16 longest
/// valid pulse, ...; microseconds.
struct RxConfig {
  int mid = 1500, min_check = 1050, max_check = 1900, shortest = 885, longest = 2115;
};
std::optional<RxConfig> read_rx_config(Payload payload) noexcept;

/// kRxMap: eight u8; place of roll, pitch, yaw, throttle, AUX1 to AUX4 among what the receiver sends.
using RxMap = std::array<std::uint8_t, 8>;
std::optional<RxMap> read_rx_map(Payload payload) noexcept;

/// kRcDeadband: u8 of roll and pitch, u8 of yaw, microseconds.
struct RcDeadband {
  int roll_pitch = 0, yaw = 0;
};
std::optional<RcDeadband> read_rc_deadband(Payload payload) noexcept;

/// kFailsafeConfig: u8 tenths of a second from loss to stage 2, u8 tenths of a second of landing (seconds since
/// 2025.12), u16 throttle, u8 switch mode, u16, u8 procedure.
struct Failsafe {
  double delay_s = 0.0;
  int throttle = 1000;
  enum class Procedure : std::uint8_t { kLand = 0, kDrop = 1, kRescue = 2 };
  Procedure procedure = Procedure::kDrop;
};
std::optional<Failsafe> read_failsafe(Payload payload) noexcept;

/// kModeRanges: four u8 each: permanent number of the mode, AUX channel from 0, begin and end in steps of 25
/// microseconds from 900. Ranges that begin where they end are not in use and left out.
struct ModeRange {
  std::uint8_t mode = 0;
  int aux = 0;
  int begin_us = 0, end_us = 0;  ///< begin <= pulse < end
};
inline constexpr std::size_t kMaxModeRanges = 40;
struct ModeRanges {
  std::size_t count = 0;
  std::array<ModeRange, kMaxModeRanges> ranges{};
};
std::optional<ModeRanges> read_mode_ranges(Payload payload) noexcept;

/// Permanent numbers of modes.
inline constexpr std::uint8_t kModeArm = 0, kModeAngle = 1, kModeHorizon = 2, kModeHeadFree = 6, kModeFailsafe = 27,
                              kModeAirmode = 28, kMode3d = 29, kModeCrashFlip = 35, kModePrearm = 36,
                              kModeParalyze = 45, kModeAcroTrainer = 47, kModeLaunchControl = 49, kModeMspOverride = 50;

/// kBoxIds: permanent numbers of the modes in the order of the bits of Status::modes.
std::vector<std::uint8_t> read_box_ids(Payload payload);

/// kFeatureConfig: u32.
std::optional<std::uint32_t> read_features(Payload payload) noexcept;
inline constexpr std::uint32_t kFeatureRxUdp = 1u << 1,  // of the target SITL, since 2026
    kFeatureMotorStop = 1u << 4, kFeature3d = 1u << 12, kFeatureRxMsp = 1u << 14, kFeatureAirmode = 1u << 22;

/// kMixerConfig: u8 kind (3: quad X), u8 yaw motors reversed (props out).
struct Mixer {
  int kind = 0;
  bool yaw_reversed = false;
};
std::optional<Mixer> read_mixer(Payload payload) noexcept;

/// kSetRawRc: u16 each, microseconds, in the order of the receiver (RxMap). The firmware takes its next values from it,
/// and goes into failsafe when none came for 0.1 s.
std::array<std::uint8_t, 2 * kMaxChannels> raw_rc(const std::array<std::uint16_t, kMaxChannels>& channels) noexcept;

/// kSetMotor: u16 each; spins motors while disarmed. 1000 is still.
std::array<std::uint8_t, 16> set_motor(const Motors& microseconds) noexcept;

}  // namespace gatefield::firmware::msp
