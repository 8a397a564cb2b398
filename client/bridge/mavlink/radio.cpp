#include "client/bridge/mavlink/radio.h"

#include <array>
#include <string>
#include <utility>

#include "common/base/text.h"

namespace gatefield::bridge {

Status validate(const RadioSwitches& radio, int channels) {
  const std::array switches{std::pair("radio.arm", radio.arm), std::pair("radio.take_over", radio.take_over),
                            std::pair("radio.kill", radio.kill)};
  for (const auto& [field, channel] : switches)
    if (channel < 0 || channel > channels)
      return Error::invalid(field, text(channel), "a channel, 1 to " + text(channels) + ", or 0 for none");
  for (std::size_t i = 0; i < switches.size(); ++i)
    for (std::size_t j = 0; j < i; ++j)
      if (switches[i].second != 0 && switches[i].second == switches[j].second)
        return Error::invalid(switches[i].first, text(switches[i].second),
                              std::string("another channel than ") + switches[j].first);
  if (radio.threshold_us < 1100 || radio.threshold_us > 1900)
    return Error::invalid("radio.threshold_us", text(radio.threshold_us) + " us", "1100 to 1900 us");
  return {};
}

flight::PilotSwitches switches(const RadioSwitches& radio, std::span<const std::uint16_t> channels_us) noexcept {
  constexpr std::uint16_t kNotThere = 0xFFFF;
  const auto on = [&](int channel) {
    if (channel < 1 || static_cast<std::size_t>(channel) > channels_us.size()) return false;
    const std::uint16_t value = channels_us[static_cast<std::size_t>(channel - 1)];
    return value != kNotThere && value >= radio.threshold_us;
  };
  return {on(radio.arm), on(radio.take_over), on(radio.kill)};
}

}  // namespace gatefield::bridge
