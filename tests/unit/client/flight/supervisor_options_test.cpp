#include "client/flight/supervisor_options.h"

#include <gmock/gmock.h>

#include <limits>
#include <utility>
#include <vector>

#include "tests/unit/client/flight/supervised_flight.h"

namespace gatefield::flight {
namespace {

using namespace std::chrono_literals;

TEST(SupervisorOptions, RangesAreSaid) {
  EXPECT_TRUE(validate(SupervisorOptions{}).ok());
  EXPECT_TRUE(validate(SupervisedFlight::usual()).ok());
  const auto refused = [](const char* field, auto change) {
    SupervisorOptions options;
    change(&options);
    const auto status = validate(options);
    ASSERT_FALSE(status.ok()) << field;
    EXPECT_EQ(status.failure().field, field);
    EXPECT_FALSE(status.failure().expected.empty());
  };
  using O = SupervisorOptions;
  const std::vector<std::pair<const char*, Stamp O::*>> times{
      {"state_settles", &O::state_settles},   {"state_doubted", &O::state_doubted},
      {"round_trip_max", &O::round_trip_max}, {"controller_silent", &O::controller_silent},
      {"pilot_silent", &O::pilot_silent},     {"fence_ahead", &O::fence_ahead},
      {"battery_low", &O::battery_low},       {"take_off_limit", &O::take_off_limit},
      {"outage_short", &O::outage_short},     {"plan_settles", &O::plan_settles},
      {"hand_over", &O::hand_over},           {"brake_limit", &O::brake_limit},
      {"hold_limit", &O::hold_limit},         {"descent_limit", &O::descent_limit},
      {"level_limit", &O::level_limit},       {"arming_limit", &O::arming_limit},
      {"disarm_limit", &O::disarm_limit},     {"give_back", &O::give_back}};
  for (const auto& [field, member] : times)
    for (const Stamp bad : {Stamp(-1s), Stamp(1000s)}) refused(field, [bad, at = member](O* o) { o->*at = bad; });
  const std::vector<std::pair<const char*, double O::*>> numbers{{"take_off_height_m", &O::take_off_height_m},
                                                                 {"take_off_speed_m_s", &O::take_off_speed_m_s},
                                                                 {"stopped_m_s", &O::stopped_m_s},
                                                                 {"descent_m_s", &O::descent_m_s},
                                                                 {"level_thrust", &O::level_thrust},
                                                                 {"gate_margin_m", &O::gate_margin_m},
                                                                 {"battery_arm_v", &O::battery_arm_v},
                                                                 {"battery_land_v", &O::battery_land_v}};
  for (const auto& [field, member] : numbers)
    for (const double bad : {-1.0, 1e6, std::numeric_limits<double>::quiet_NaN()})
      refused(field, [bad, at = member](O* o) { o->*at = bad; });
  refused("state.lost_after", [](O* o) { o->state.lost_after = 2s; });
  refused("state.jump_m", [](O* o) { o->state.jump_m = 0; });
  refused("state.jump_rad", [](O* o) { o->state.jump_rad = 4; });
  refused("take_off_limit", [](O* o) { o->take_off_height_m = 10; });
  refused("battery_arm_v", [](O* o) { o->battery_arm_v = 13, o->battery_land_v = 14; });
  refused("fence", [](O* o) { o->fence = Fence{{0, 0, 0}, {1, 1, 0.5}}; });
  refused("fence", [](O* o) { o->fence = Fence{{0, 0, 0}, {1, 1, std::numeric_limits<double>::infinity()}}; });
}

}  // namespace
}  // namespace gatefield::flight
