#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>

#include "common/base/result.h"
#include "common/dds/network.h"

/// Which names PX4's topics have and which layouts its messages have: both differ from release to release.
namespace gatefield::px4 {

/// PX4's releases by their layouts.
enum class Release : std::uint8_t { k1_15, k1_16, k1_17, k1_18 };

/// As people write them: "1.15" and so on.
const std::map<std::string, Release>& release_names();
std::string_view name(Release release) noexcept;

/// Where PX4 is to be found on the bus.
struct BusOptions {
  std::uint32_t domain = 0;  ///< PX4's UXRCE_DDS_DOM_ID; 0 to 232
  std::string name_space;    ///< of PX4's client (its option -n, or "px4_1" of a second SITL); empty: none
  Release release = Release::k1_16;
  /// Versions that differ from the release's, by topic ("vehicle_status"): a build from between two releases. The
  /// layout stays the release's.
  std::map<std::string, int> versions;
  dds::NetworkOptions network;
};

/// Says which field is wrong and why. Topics in `versions` are those that are used; their versions 0 to 99.
Status validate(const BusOptions& options);

/// The name on the bus: "rt/fmu/out/vehicle_status_v1". @param topic  kTopic of one of the messages
std::string topic_to_px4(const BusOptions& options, std::string_view topic);
std::string topic_from_px4(const BusOptions& options, std::string_view topic);

/// What of a name on the bus differs from topic_from_px4(options, topic): another version, or another namespace.
/// Empty: it is that one, or another topic altogether.
std::string difference(const BusOptions& options, std::string_view topic, std::string_view on_the_bus);

}  // namespace gatefield::px4
