#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

#include "client/bridge/betaflight/options.h"
#include "client/firmware/msp/connection.h"
#include "client/firmware/msp/messages.h"
#include "client/flight/ports.h"

namespace gatefield::bridge::betaflight {

namespace msp = firmware::msp;

/// What the firmware says of itself and how it is set up; read once, before the flight.
struct Settings {
  std::string variant;
  msp::FirmwareVersion version;
  msp::RcTuning tuning;
  msp::RxConfig rx;
  msp::RxMap map{};
  msp::RcDeadband deadband;
  msp::Failsafe failsafe;
  msp::Mixer mixer;
  std::uint32_t features = 0;
  msp::ModeRanges ranges;
  std::vector<std::uint8_t> boxes;  ///< modes in the order of Status::modes' bits
};

/// Asks for all of it. Errors: as Connection::ask(); kUnsupported with field "firmware" when it is none of ours, or a
/// version that is not known; kInvalid with field "link" when an answer can't be understood.
Result<Settings> read_settings(msp::Connection& connection, std::chrono::nanoseconds timeout);

/// Whether it hears channels over UDP, built for the target SITL: since 4.5.
bool hears_udp(const msp::FirmwareVersion& version) noexcept;

/// Says what of the settings does not go with the options, one after the other: field is the firmware's own name of the
/// setting, the sentence says what to set. In order:
///   features      RX_MSP is on (Receiver::kBridge), or RX_UDP (kUdp, since 2026); 3D is off
///   mid_rc        1500, so that sticks reach both ends within valid pulses
///   aux           the mode ARM is on the channel and pulse of the options, and off at 1000; MSP OVERRIDE exists
///                 (Receiver::kOverride); no mode that flies another way is on with the channels that are sent
///   mixer         quad X
///   rates         each axis reaches `rates_rad_s`, at least, and has a rate at all
Status check(const Settings& settings, const Options& options, const std::array<double, 3>& rates_rad_s);

/// Whether the firmware does something sensible within 2 s when the channels stop. Sets `why` when it does not. With
/// Receiver::kOverride nothing in the firmware does: the person's switch is what ends it, and whether somebody has a
/// thumb on it can't be checked (kNotChecked).
flight::FirmwareFailsafe judge_failsafe(const Settings& settings, const Options& options, std::string* why);

/// Pulses of the AUX channels as they are sent, AUX1 first; modes are held against them.
inline constexpr int kAuxOff_us = 1000;

}  // namespace gatefield::bridge::betaflight
