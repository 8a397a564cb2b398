#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <variant>
#include <vector>

#include "client/bridge/betaflight/options.h"
#include "client/bridge/mavlink/config.h"
#include "client/bridge/px4/config.h"
#include "client/bridge/sources/options.h"
#include "client/flight/loop.h"
#include "client/flight/supervisor_options.h"
#include "common/base/result.h"
#include "gatefield/sdk/client.h"

/// The bridge's text file.
namespace gatefield::bridge {

enum class Firmware { kBetaflight, kMavlink, kPx4 };

/// As command lines and sections of the file name them: "betaflight", "mavlink", "px4".
const std::map<std::string, Firmware>& firmware_names();

struct BridgeConfig {
  sdk::Options session;  ///< in real time, and driven by body rates
  flight::SupervisorOptions safety;
  flight::LoopOptions loop;
  std::variant<betaflight::Options, MavlinkConfig, Px4Config> firmware;
  sources::Options sources;
  std::vector<std::string> notes;  ///< what was taken otherwise than written, for the person whose file it is
};

/// Reads a file (schema: bridge.proto) with the vehicle and the course that it names, and checks all of it. A vehicle
/// file that says rotor thrusts is driven by body rates with the usual lags (config::driven_by()).
/// Errors: as load_text(), find_config(), load_vehicle() and load_track(); else kInvalid with the path of the field
/// ("safety.hold_limit", "mavlink.link.port") and a sentence that names file, field, value and what was expected.
/// Beyond each part's own checks:
///   - the section of `firmware` is there;
///   - somebody can arm: safety.arm_by agrees with radio.arm and arm_by_command of the section, or with
///     betaflight.receiver;
///   - where the firmware knows no position (Betaflight) and `flies`, a section states is there;
///   - for PX4 over DDS a person has said that its failsafe is good (safety.needs_firmware_failsafe: false).
/// Thread-safe: yes.   Real-time safe: no.
/// @param flies  false: only to look at the flight controller
Result<BridgeConfig> load_config(const std::filesystem::path& file, Firmware firmware, bool flies = true);

}  // namespace gatefield::bridge
