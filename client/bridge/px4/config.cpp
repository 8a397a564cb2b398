#include "client/bridge/px4/config.h"

#include "common/base/text.h"
#include "common/dds/px4/messages.h"

namespace gatefield::bridge {
namespace {

int channels(RadioFrom from) noexcept {
  return static_cast<int>(from == RadioFrom::kInputRc ? px4::InputRc::kChannels : px4::ManualControlSetpoint::kAuxes);
}

}  // namespace

Status validate(const Px4Config& config) {
  if (Status status = px4::validate(config.bus); !status) return status;
  if (config.own_system == 0) return Error::invalid("own_system", "0", "1 to 255");
  if (config.own_component == 0) return Error::invalid("own_component", "0", "1 to 65535");
  if (!(config.setpoint_rate_hz >= 20 && config.setpoint_rate_hz <= 500))
    return Error::invalid("setpoint_rate_hz", text(config.setpoint_rate_hz) + " Hz", "20 to 500 Hz");
  if (Status status = validate_link(config.link_delay, config.connect_timeout); !status) return status;
  if (Status status = validate_arming(config.arm_by_command, config.radio); !status) return status;
  if (Status status = validate(config.clock); !status) return status;
  if (Status status = validate(config.state); !status) return status;
  if (Status status = validate(config.radio, channels(config.radio_from)); !status) return status;
  if (Status status = flight::validate(config.thrust); !status) return status.failure().within("thrust: ", "thrust.");
  return gatefield::validate(config.quadrotor);
}

}  // namespace gatefield::bridge
