#include "client/simulator/px4_options.h"

#include <tuple>

#include "client/firmware/link/link.h"
#include "common/base/text.h"

namespace gatefield::simulator {
namespace {

Status check(const px4::BusOptions& bus, const firmware::HilOptions&) { return px4::validate(bus); }

Status check(const std::string& link, const firmware::HilOptions& hil) {
  const auto address = firmware::parse_address(link);
  if (!address) return address.failure().within("", "setpoints.");
  if (link == hil.address)
    return Error::invalid("setpoints", "'" + link + "'", "another link than the sensors', or 'same' for that one");
  return {};
}

Status check(const SameLink&, const firmware::HilOptions& hil) {
  if (firmware::is_board(hil)) return {};
  return Error::invalid("setpoints", "the sensors' own link",
                        "a board's (serial:DEVICE:BAUD): PX4's SITL takes none there");
}

}  // namespace

Status validate(const Px4Options& options) {
  if (Status status = firmware::validate(options.hil); !status) return status.failure().within("PX4's sensors: ");
  if (Status status = firmware::validate(options.sensors); !status) return status.failure().within("PX4's sensors: ");
  if (Status status = std::visit([&](const auto& way) { return check(way, options.hil); }, options.setpoints); !status)
    return status.failure().within("PX4's setpoints: ");
  const bool board = firmware::is_board(options.hil);
  if (board) {
    const bool beside = std::holds_alternative<SameLink>(options.setpoints);
    if (Status status = firmware::check_room(options.hil, beside ? kPx4Setpoints_hz : 0.0); !status)
      return status.failure().within("PX4's sensors: ");
  }
  if (board && options.pace != 1.0)
    return Error::invalid("pace", text(options.pace), "1: a board runs by its own clock");
  for (const auto& [field, value, least, most] :
       {std::tuple("thrust_model_factor", options.thrust_model_factor, 0.0, 1.0),
        std::tuple("pace", options.pace, 0.01, 20.0), std::tuple("arm_limit", seconds(options.arm_limit), 1.0, 300.0)})
    if (!(value >= least && value <= most))
      return Error::invalid(field, text(value), text(least) + " to " + text(most));
  return {};
}

}  // namespace gatefield::simulator
