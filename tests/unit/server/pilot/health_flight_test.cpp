// No false alarms: races with the shipped model, planner and sensor, in which nothing is wrong that anybody could mend.

#include <gtest/gtest.h>

#include "common/protocol/problems.h"
#include "tests/unit/server/pilot/flight.h"

namespace gatefield::pilot {
namespace {

using namespace std::chrono_literals;

std::string names(protocol::Problems problems) {
  std::string out;
  for (const protocol::Problem problem : protocol::list(problems)) out += " " + std::string(protocol::name(problem));
  return out;
}

void fly_without_an_alarm(const testing::Conditions& conditions) {
  testing::Flight flight(protocol::Timing::kLockstep, conditions);
  const auto pilot = flight.make_pilot();
  for (int i = 0; i < 60 && flight.problems() == 0 && flight.lap() < 1; ++i) {
    flight.fly(pilot.get(), 20);
    EXPECT_EQ(flight.problems(), 0u) << names(flight.problems()) << " after " << 0.4 * i << " s";
  }
  EXPECT_EQ(flight.lap(), 1u) << "a whole lap";
}

TEST(HealthOfAFlight, IsGoodInANormalRace) { fly_without_an_alarm({}); }

TEST(HealthOfAFlight, IsGoodWithTheNoiseOfAnEstimator) {
  testing::Conditions conditions;  // as the scenario circle-hard has it
  conditions.position_sigma_m = 0.01;
  conditions.velocity_sigma_m_s = 0.05;
  conditions.attitude_sigma_rad = 0.25 * M_PI / 180.0;
  conditions.rate_sigma_rad_s = 0.02;
  fly_without_an_alarm(conditions);
}

TEST(HealthOfAFlight, IsGoodOverALinkWithADelayOf50Milliseconds) {
  testing::Conditions conditions;
  conditions.each_way = 50ms;
  fly_without_an_alarm(conditions);
}

TEST(HealthOfAFlight, IsGoodWithAVehicleAndWeatherThatNobodyTold) {
  testing::Conditions conditions;
  conditions.plant.mass_kg *= 1.1;
  conditions.plant.drag_kg_s *= 1.5;
  conditions.plant.rotor_time_constant_s *= 1.5;
  conditions.wind_W_m_s = {4, 0, 0};
  fly_without_an_alarm(conditions);
}

}  // namespace
}  // namespace gatefield::pilot
