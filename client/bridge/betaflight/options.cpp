#include "client/bridge/betaflight/options.h"

#include "common/base/text.h"

namespace gatefield::bridge::betaflight {

Status validate(const Options& options) {
  constexpr int kMaxAux = 14;
  if (!(options.channels_hz >= 50 && options.channels_hz <= 500))
    return Error::invalid("channels_hz", text(options.channels_hz), "50 to 500 (the firmware's failsafe begins at 10)");
  if (options.arm_aux < 1 || options.arm_aux > kMaxAux)
    return Error::invalid("arm_aux", text(options.arm_aux), "the number of an AUX channel, 1 to 14");
  if (options.arm_us < 1000 || options.arm_us > 2000)
    return Error::invalid("arm_us", text(options.arm_us), "1000 to 2000 microseconds");
  if (options.kill) {
    if (options.receiver != Options::Receiver::kOverride)
      return Error::invalid("kill", "given", "nothing where the bridge is the receiver: there is no person's switch");
    if (options.kill->aux < 1 || options.kill->aux > kMaxAux)
      return Error::invalid("kill.aux", text(options.kill->aux), "the number of an AUX channel, 1 to 14");
    if (options.kill->to_us < 900 || options.kill->to_us > 2100)
      return Error::invalid("kill.to_us", text(options.kill->to_us), "900 to 2100 microseconds");
    if (options.kill->from_us < 900 || options.kill->from_us >= options.kill->to_us)
      return Error::invalid("kill.from_us", text(options.kill->from_us),
                            "900 to less than kill.to_us (" + text(options.kill->to_us) + ") microseconds");
  }
  if (auto status = flight::validate(options.thrust); !status) return status.failure().within("thrust.", "thrust.");
  return {};
}

}  // namespace gatefield::bridge::betaflight
