#include "client/bridge/betaflight/settings.h"

#include <algorithm>
#include <array>
#include <numbers>

#include "client/bridge/betaflight/stick_curve.h"
#include "common/base/text.h"

namespace gatefield::bridge::betaflight {
namespace {

constexpr int kQuadX = 3;
constexpr std::array kAxes{"roll", "pitch", "yaw"};

/// Modes with which sticks do not mean rates, or nothing flies.
struct ForbiddenMode {
  std::uint8_t mode;
  const char* name;
};
constexpr std::array kForbidden{ForbiddenMode{msp::kModeAngle, "ANGLE"},
                                ForbiddenMode{msp::kModeHorizon, "HORIZON"},
                                ForbiddenMode{msp::kModeHeadFree, "HEADFREE"},
                                ForbiddenMode{msp::kModeFailsafe, "FAILSAFE"},
                                ForbiddenMode{msp::kMode3d, "3D"},
                                ForbiddenMode{msp::kModeCrashFlip, "FLIP OVER AFTER CRASH"},
                                ForbiddenMode{msp::kModeParalyze, "PARALYZE"},
                                ForbiddenMode{msp::kModeAcroTrainer, "ACRO TRAINER"},
                                ForbiddenMode{msp::kModeLaunchControl, "LAUNCH CONTROL"}};

Error setting(const std::string& field, const std::string& value, const std::string& expected,
              const std::string& next_step) {
  Error error = Error::invalid(field, value, expected);
  error.message = "the firmware's " + error.message + "; " + next_step;
  return error;
}

std::string text_of(const msp::FirmwareVersion& version) {
  return text(version.major) + "." + text(version.minor) + "." + text(version.patch);
}

bool known(const msp::FirmwareVersion& version) {
  if (version.major == 4) return version.minor >= 4 && version.minor <= 6;
  return version.major == 2025 || version.major == 2026;
}

bool contains(const msp::ModeRange& range, int pulse_us) {
  return range.begin_us <= pulse_us && pulse_us < range.end_us;
}

bool is_on(const Settings& settings, std::uint8_t mode, int aux, int pulse_us) {
  const auto ranges = std::span(settings.ranges.ranges).first(settings.ranges.count);
  return std::any_of(ranges.begin(), ranges.end(), [&](const msp::ModeRange& range) {
    return range.mode == mode && range.aux == aux && contains(range, pulse_us);
  });
}

bool exists(const Settings& settings, std::uint8_t mode) {
  const auto ranges = std::span(settings.ranges.ranges).first(settings.ranges.count);
  return std::any_of(ranges.begin(), ranges.end(), [&](const msp::ModeRange& range) { return range.mode == mode; });
}

/// Asks, and has `read` make something of the answer.
template <typename Read>
auto asked(msp::Connection& connection, std::uint16_t command, std::chrono::nanoseconds timeout, Read read)
    -> Result<typename decltype(read(msp::Payload()))::value_type> {
  auto answer = connection.ask(command, timeout);
  if (!answer) return answer.failure();
  auto value = read(*answer);
  if (!value)
    return Error(connection.name() + ": the answer to MSP command " + text(command) + " makes no sense (" +
                     text(answer->size()) + " bytes); look whether the firmware is Betaflight 4.4 or later",
                 ErrorCode::kInvalid, "link");
  return *value;
}

/// Until 2025 a firmware on a computer takes channels from UDP as soon as they come, whatever its receiver is.
Status check_receiver(const Settings& settings, const Options& options) {
  constexpr int kUdpIsAFeature = 2026;
  const bool over_udp = options.receiver == Options::Receiver::kUdp && hears_udp(settings.version);
  if (over_udp && settings.version.major >= kUdpIsAFeature && (settings.features & msp::kFeatureRxUdp) == 0)
    return setting("feature RX_UDP", "off", "on", "switch the others off and it on in its command line");
  if (!over_udp && options.receiver != Options::Receiver::kOverride && (settings.features & msp::kFeatureRxMsp) == 0)
    return setting("feature RX_MSP", "off", "on",
                   "choose MSP as the receiver in the Receiver tab, or receiver: OVERRIDE in the configuration");
  return {};
}

Status check_modes(const Settings& settings, const Options& options) {
  const int arm_aux = options.arm_aux - 1;
  const std::string channel = "AUX" + text(options.arm_aux);
  if (!is_on(settings, msp::kModeArm, arm_aux, options.arm_us))
    return setting("aux", "without ARM on " + channel + " at " + text(options.arm_us) + " us", "that mode there",
                   "set it in the Modes tab, or arm_aux and arm_us in the bridge's configuration");
  if (is_on(settings, msp::kModeArm, arm_aux, kAuxOff_us))
    return setting("aux", "ARM on " + channel + " at " + text(kAuxOff_us) + " us", "ARM off at that pulse",
                   "move its range up in the Modes tab, or it would never disarm");
  if (options.receiver == Options::Receiver::kOverride) {
    if (!exists(settings, msp::kModeMspOverride))
      return setting("aux", "without MSP OVERRIDE", "that mode on a switch of the radio",
                     "set it in the Modes tab, and msp_override_channels_mask = 15 in its command line");
    return {};
  }
  for (const auto& [mode, name] : kForbidden) {
    for (int aux = 0; aux < static_cast<int>(msp::kMaxChannels) - 4; ++aux) {
      for (const int pulse : {kAuxOff_us, aux == arm_aux ? options.arm_us : kAuxOff_us}) {
        if (is_on(settings, mode, aux, pulse))
          return setting("aux", std::string(name) + " on AUX" + text(aux + 1) + " at " + text(pulse) + " us",
                         "that mode off there", "take it away in the Modes tab: sticks must mean rates");
      }
    }
  }
  if (exists(settings, msp::kModePrearm))
    return setting("aux", "PREARM", "ARM alone", "take PREARM away in the Modes tab");
  return {};
}

}  // namespace

Result<Settings> read_settings(msp::Connection& connection, std::chrono::nanoseconds timeout) {
  Settings settings;
  auto variant = connection.ask(msp::command::kFcVariant, timeout);
  if (!variant) return variant.failure();
  settings.variant = msp::read_variant(*variant);
  if (settings.variant != "BTFL")
    return Error::invalid("firmware", "'" + shown(settings.variant, 16) + "'",
                          "Betaflight (BTFL); flash it, or use another bridge", ErrorCode::kUnsupported);
  Status status;
  const auto take = [&](std::uint16_t command, auto read, auto* into) {
    if (!status) return;
    auto value = asked(connection, command, timeout, read);
    if (value) {
      *into = *value;
    } else {
      status = value.failure();
    }
  };
  take(msp::command::kFcVersion, msp::read_firmware_version, &settings.version);
  if (status && !known(settings.version))
    return Error::invalid("firmware", "Betaflight " + text_of(settings.version),
                          "4.4 to 2026.12; flash one of these, since rates and modes of others are not known",
                          ErrorCode::kUnsupported);
  take(msp::command::kRcTuning, msp::read_rc_tuning, &settings.tuning);
  take(msp::command::kRxConfig, msp::read_rx_config, &settings.rx);
  take(msp::command::kRxMap, msp::read_rx_map, &settings.map);
  take(msp::command::kRcDeadband, msp::read_rc_deadband, &settings.deadband);
  take(msp::command::kFailsafeConfig, msp::read_failsafe, &settings.failsafe);
  take(msp::command::kMixerConfig, msp::read_mixer, &settings.mixer);
  take(msp::command::kFeatureConfig, msp::read_features, &settings.features);
  take(msp::command::kModeRanges, msp::read_mode_ranges, &settings.ranges);
  take(
      msp::command::kBoxIds, [](msp::Payload ids) { return std::optional(msp::read_box_ids(ids)); }, &settings.boxes);
  if (!status) return status.failure();
  return settings;
}

bool hears_udp(const msp::FirmwareVersion& version) noexcept {
  return version.major > 4 || (version.major == 4 && version.minor >= 5);
}

Status check(const Settings& settings, const Options& options, const std::array<double, 3>& rates_rad_s) {
  if (auto status = check_receiver(settings, options); !status) return status.failure();
  if ((settings.features & msp::kFeature3d) != 0)
    return setting("feature 3D", "on", "off", "switch it off: motors that turn backwards are not planned for");
  if (settings.rx.mid != 1500)
    return setting("mid_rc", text(settings.rx.mid), "1500", "set it in the Receiver tab: sticks reach both ends then");
  if (auto status = check_modes(settings, options); !status) return status.failure();
  if (settings.mixer.kind != kQuadX)
    return setting("mixer", text(settings.mixer.kind), "3 (QUADX)", "set mixer QUADX in its command line");
  const std::array deadbands{settings.deadband.roll_pitch, settings.deadband.roll_pitch, settings.deadband.yaw};
  for (std::size_t i = 0; i < kAxes.size(); ++i) {
    const StickCurve curve(settings.tuning.type, settings.tuning.axes[i], deadbands[i]);
    constexpr double kDegree = std::numbers::pi / 180.0;
    const std::string most = fixed(curve.max_rad_s() / kDegree, 0) + " deg/s";
    if (curve.max_rad_s() <= 0 || curve.max_rad_s() < rates_rad_s[i])
      return setting(std::string(kAxes[i]) + "_srate", most + " at full stick",
                     "at least " + fixed(rates_rad_s[i] / kDegree, 0) + " deg/s, as the vehicle file may ask for",
                     "raise it in the Rates tab, or lower body_rate_max_rad_s in the vehicle file");
  }
  return {};
}

flight::FirmwareFailsafe judge_failsafe(const Settings& settings, const Options& options, std::string* why) {
  constexpr double kLongest_s = 2.0;
  if (options.receiver == Options::Receiver::kOverride) {
    *why =
        "in the mode MSP OVERRIDE the firmware keeps the last channels for as long as the radio is heard: only the "
        "person's switch ends that; keep a thumb on it, and say safety.needs_firmware_failsafe: false";
    return flight::FirmwareFailsafe::kNotChecked;
  }
  if (settings.failsafe.delay_s > kLongest_s) {
    *why = "the firmware's failsafe_delay is " + fixed(settings.failsafe.delay_s, 1) + " s, expected at most " +
           fixed(kLongest_s, 1) + " s; set failsafe_delay = 10 in its command line";
    return flight::FirmwareFailsafe::kBad;
  }
  if (settings.failsafe.procedure == msp::Failsafe::Procedure::kRescue) {
    *why = "the firmware's failsafe_procedure is GPS-RESCUE, expected DROP or AUTO-LAND; set it in its command line";
    return flight::FirmwareFailsafe::kBad;
  }
  why->clear();
  return flight::FirmwareFailsafe::kGood;
}

}  // namespace gatefield::bridge::betaflight
