#include "client/race/tune/default_fields.h"

#include <gmock/gmock.h>

#include "tests/unit/client/race/tune/sheets.h"

namespace gatefield::race {
namespace {

using testing::ElementsAre;

std::vector<std::string> names(const ProfileSheet& base, Actuation::Kind kind) {
  std::vector<std::string> out;
  for (const Dimension& d : default_fields(base, kind)) out.push_back(d.name);
  return out;
}

TEST(DefaultFields, EachKindOfActuationHasItsNoise) {
  ProfileSheet base = sheet_of();
  EXPECT_THAT(names(base, Actuation::Kind::kRotorThrusts),
              ElementsAre("temperature", "crossing_margin_m", "rotors_thrust_sigma_s", "rotors_yaw_sigma_rad_s3"));
  EXPECT_THAT(names(base, Actuation::Kind::kBodyRates),
              ElementsAre("temperature", "crossing_margin_m", "rates_thrust_sigma", "rates_correlation"));
  base.set("rates_by_changes", "true");
  EXPECT_THAT(names(base, Actuation::Kind::kBodyRates),
              ElementsAre("temperature", "crossing_margin_m", "rates_thrust_change_sigma_s"));
}

TEST(DefaultFields, EffectiveSamplesStandInForATemperatureThatIsFound) {
  ProfileSheet base = sheet_of();
  base.set("target_effective_fraction", "0.4");
  const Dimension first = default_fields(base, Actuation::Kind::kRotorThrusts).front();
  EXPECT_EQ(first.name, "target_effective_fraction");
  EXPECT_DOUBLE_EQ(first.min, 0.1);
  EXPECT_DOUBLE_EQ(first.max, 1.0) << "no more than the field may be";
}

TEST(DefaultFields, AllOfThemMakeASpace) {
  for (const auto kind : {Actuation::Kind::kRotorThrusts, Actuation::Kind::kBodyRates}) {
    const auto made = Space::make(default_fields(sheet_of(), kind), sheet_of());
    EXPECT_TRUE(made.ok()) << made.error();
  }
}

}  // namespace
}  // namespace gatefield::race
