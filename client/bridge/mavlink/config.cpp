#include "client/bridge/mavlink/config.h"

#include <utility>

#include "client/firmware/link/link.h"
#include "client/firmware/mavlink/messages_link.h"
#include "common/base/text.h"

namespace gatefield::bridge {
namespace {

using namespace std::chrono_literals;

std::string milliseconds(Stamp span) { return text(seconds(span) * 1e3) + " ms"; }

}  // namespace

Status validate_link(Stamp link_delay, Stamp connect_timeout) {
  if (link_delay < 0ms || link_delay > 200ms)
    return Error::invalid("link_delay", milliseconds(link_delay), "0 to 200 ms");
  if (connect_timeout < 100ms || connect_timeout > 10min)
    return Error::invalid("connect_timeout", milliseconds(connect_timeout), "100 ms to 10 min");
  return {};
}

Status validate_arming(bool arm_by_command, const RadioSwitches& radio) {
  if (arm_by_command && radio.arm != 0)
    return Error::invalid("arm_by_command", "true", "false where radio.arm names the person's switch");
  return {};
}

Status validate(const MavlinkConfig& config) {
  if (const auto address = firmware::parse_address(config.link); !address)
    return address.failure().within("link: ", "link.");
  if (config.own_system == 0) return Error::invalid("own_system", "0", "1 to 255");
  if (config.own_component == 0) return Error::invalid("own_component", "0", "1 to 255");
  if (config.vehicle_system == config.own_system)
    return Error::invalid("vehicle_system", text(config.vehicle_system), "another number than own_system");
  for (const auto& [field, rate] :
       {std::pair("setpoint_rate_hz", config.setpoint_rate_hz), std::pair("state_rate_hz", config.state_rate_hz)})
    if (!(rate >= 20 && rate <= 500)) return Error::invalid(field, text(rate) + " Hz", "20 to 500 Hz");
  if (Status status = validate_link(config.link_delay, config.connect_timeout); !status) return status;
  if (Status status = validate_arming(config.arm_by_command, config.radio); !status) return status;
  if (Status status = validate(config.time_sync); !status) return status;
  if (Status status = validate(config.state); !status) return status;
  if (Status status = validate(config.radio, mavlink::RcChannels::kChannels); !status) return status;
  if (Status status = flight::validate(config.thrust); !status) return status.failure().within("thrust: ", "thrust.");
  return gatefield::validate(config.quadrotor);
}

}  // namespace gatefield::bridge
