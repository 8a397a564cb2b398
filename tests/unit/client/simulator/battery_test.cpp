#include "client/simulator/battery.h"

#include <gtest/gtest.h>

#include <cmath>

namespace gatefield::simulator {
namespace {

config::AirErrors standard() { return config::hard_world({config::WorldPart::kBattery}).air; }

TEST(Battery, GivesTheThrustThatWasToldInAHoverAtHalfCharge) {
  EXPECT_NEAR(Battery(standard(), 0.5).factor(1.0), 1.0, 1e-12);
}

TEST(Battery, ThrustFallsWithTheCharge) {
  double last = 2.0;
  for (const double charge : {1.0, 0.95, 0.8, 0.6, 0.5, 0.4, 0.25, 0.1, 0.05, 0.0}) {
    const double factor = Battery(standard(), charge).factor(1.0);
    EXPECT_LT(factor, last) << charge;
    last = factor;
  }
  // 4.20 and 3.30 V at rest, of 3.83 V, and the square of it; the sag is a little more of less.
  EXPECT_NEAR(Battery(standard(), 1.0).factor(1.0), std::pow(4.20 / 3.83, 2), 0.01);
  EXPECT_NEAR(Battery(standard(), 0.0).factor(1.0), std::pow(3.30 / 3.83, 2), 0.01);
}

TEST(Battery, SagsUnderLoadAsAResistanceDoes) {
  const config::AirErrors air = standard();
  const Battery battery(air, 0.5);
  const double told = 0.5 * (1.0 + std::sqrt(1.0 - 4.0 * air.sag));
  for (const double power : {0.0, 1.0, 4.0, 10.0}) {
    const double x = told * std::sqrt(battery.factor(power));  // voltage over that at rest
    EXPECT_NEAR(x * x - x + air.sag * power, 0.0, 1e-12) << power;
  }
  EXPECT_LT(battery.factor(10.0), 0.75) << "full thrust is well below what was told";
}

TEST(Battery, IsEmptyAfterTheTimeThatItHoversAndStaysSo) {
  const config::AirErrors air = standard();
  Battery battery(air, 1.0);
  for (int i = 0; i < 300; ++i) battery.spend(1.0, 1.0);
  EXPECT_NEAR(battery.charge(), 1.0 - 300.0 / air.hover_s, 1e-9);
  for (int i = 0; i < 1000; ++i) battery.spend(2.0, 1.0);
  EXPECT_EQ(battery.charge(), 0.0);
  EXPECT_TRUE(std::isfinite(battery.factor(100.0)));
  EXPECT_GT(battery.factor(100.0), 0.0);
}

}  // namespace
}  // namespace gatefield::simulator
