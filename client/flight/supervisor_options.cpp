#include "client/flight/supervisor_options.h"

#include <array>
#include <string>

#include "common/base/text.h"

namespace gatefield::flight {

Status validate(const SupervisorOptions& options) {
  if (auto state = validate(options.state); !state) return state.failure().within("state: ", "state.");

  struct Time {
    const char* field;
    Stamp value;
    double low_s, high_s;
  };
  for (const Time& time : std::array{
           Time{"state_settles", options.state_settles, 0.1, 10}, Time{"state_doubted", options.state_doubted, 0.1, 5},
           Time{"round_trip_max", options.round_trip_max, 0.005, 0.4},
           Time{"controller_silent", options.controller_silent, 0.05, 5},
           Time{"pilot_silent", options.pilot_silent, 0.1, 10}, Time{"fence_ahead", options.fence_ahead, 0, 3},
           Time{"battery_low", options.battery_low, 0, 30}, Time{"take_off_limit", options.take_off_limit, 1, 60},
           Time{"outage_short", options.outage_short, 0, 1}, Time{"plan_settles", options.plan_settles, 0.1, 30},
           Time{"hand_over", options.hand_over, 0, 10}, Time{"brake_limit", options.brake_limit, 1, 30},
           Time{"hold_limit", options.hold_limit, 0, 300}, Time{"descent_limit", options.descent_limit, 1, 600},
           Time{"level_limit", options.level_limit, 0.1, 30}, Time{"arming_limit", options.arming_limit, 0.5, 30},
           Time{"disarm_limit", options.disarm_limit, 0.5, 30}, Time{"give_back", options.give_back, 0, 5}})
    if (const double value_s = seconds(time.value); !(value_s >= time.low_s && value_s <= time.high_s))
      return Error::invalid(time.field, text(value_s) + " s", text(time.low_s) + " to " + text(time.high_s) + " s");

  struct Range {
    const char *field, *unit;
    double value, low, high;
  };
  for (const Range& range : std::array{Range{"take_off_height_m", " m", options.take_off_height_m, 0.3, 20},
                                       Range{"take_off_speed_m_s", " m/s", options.take_off_speed_m_s, 0.1, 3},
                                       Range{"stopped_m_s", " m/s", options.stopped_m_s, 0.1, 2},
                                       Range{"descent_m_s", " m/s", options.descent_m_s, 0.1, 2},
                                       Range{"level_thrust", "", options.level_thrust, 0.7, 0.98},
                                       Range{"gate_margin_m", " m", options.gate_margin_m, 0, 3},
                                       Range{"tilt_apart_rad", " rad", options.tilt_apart_rad, 0.05, 3.2},
                                       Range{"battery_arm_v", " V", options.battery_arm_v, 0, 100},
                                       Range{"battery_land_v", " V", options.battery_land_v, 0, 100}})
    if (!(range.value >= range.low && range.value <= range.high))
      return Error::invalid(range.field, text(range.value) + range.unit,
                            text(range.low) + " to " + text(range.high) + range.unit);

  if (seconds(options.take_off_limit) * options.take_off_speed_m_s < 1.2 * options.take_off_height_m)
    return Error::invalid("take_off_limit", text(seconds(options.take_off_limit)) + " s",
                          "enough for " + text(options.take_off_height_m) + " m at " +
                              text(options.take_off_speed_m_s) + " m/s and a fifth more");
  if (options.battery_arm_v > 0 && options.battery_arm_v < options.battery_land_v)
    return Error::invalid("battery_arm_v", text(options.battery_arm_v) + " V",
                          "battery_land_v (" + text(options.battery_land_v) + " V) or more");
  if (options.fence) {
    const Fence& fence = *options.fence;
    constexpr double kFarthest_m = 1e5;  // of a position on the wire
    const bool near =
        (fence.low_W.array().abs() <= kFarthest_m).all() && (fence.high_W.array().abs() <= kFarthest_m).all();
    if (!near || !((fence.high_W - fence.low_W).array() >= 1.0).all())
      return Error::invalid("fence", text(fence.low_W) + " to " + text(fence.high_W) + " m",
                            "corners within 100000 m, at least 1 m apart along each axis, the lower one first");
  }
  return {};
}

}  // namespace gatefield::flight
