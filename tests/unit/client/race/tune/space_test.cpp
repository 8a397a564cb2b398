#include "client/race/tune/space.h"

#include <gmock/gmock.h>

#include "tests/unit/client/race/tune/sheets.h"

namespace gatefield::race {
namespace {

using testing::HasSubstr;

Space space() {
  auto made = Space::make({{"temperature", 0.1, 10, true}, {"unseen_speed_factor", 0.2, 1, false}}, sheet_of());
  EXPECT_TRUE(made.ok()) << made.error();
  return std::move(made).value();
}

TEST(Space, ALogarithmIsHalfWayAtTheGeometricMean) {
  EXPECT_EQ(space().value({0.0, 0.0}, 0), "0.1");
  EXPECT_EQ(space().value({1.0, 0.0}, 0), "10");
  EXPECT_EQ(space().value({0.75, 0.25}, 0), "3.162");
  EXPECT_EQ(space().value({0.75, 0.25}, 1), "0.4");
}

TEST(Space, TheStartIsTheBaseItself) {
  EXPECT_DOUBLE_EQ(space().start()[0], 0.5);
  EXPECT_DOUBLE_EQ(space().start()[1], 0.5);
  EXPECT_EQ(space().profile(space().start()).text(), kSheet);
  ProfileSheet odd = sheet_of();
  odd.set("temperature", "0.123456789");
  const auto made = Space::make({{"temperature", 0.1, 10, true}}, odd);
  EXPECT_EQ(made->value(made->start(), 0), "0.123456789") << "the base is not rounded";
}

TEST(Space, ValuesComeBackAsPoints) {
  const Space all = space();
  for (const double x : {0.0, 0.1, 0.37, 0.5, 0.99, 1.0}) {
    ProfileSheet moved = all.profile({x, x});
    const auto again = Space::make(all.dimensions(), moved);
    ASSERT_TRUE(again.ok()) << again.error();
    EXPECT_NEAR(again->start()[0], x, 2e-4) << "four digits";
    EXPECT_NEAR(again->start()[1], x, 2e-4);
  }
}

TEST(Space, OutsideIsTheNearestAndItsDistanceSquared) {
  EXPECT_EQ(space().value({-0.3, 1.2}, 0), "0.1");
  EXPECT_EQ(space().value({-0.3, 1.2}, 1), "1");
  EXPECT_NEAR(Space::outside({-0.3, 1.2}), 0.09 + 0.04, 1e-12);
  EXPECT_EQ(Space::outside({0.0, 1.0}), 0.0);
}

TEST(Space, WhatCanNotBeLookedForIsRefused) {
  const auto refusal = [](const Dimension& d) { return Space::make({d}, sheet_of()).error(); };
  EXPECT_THAT(refusal({"warp", 0, 1}),
              HasSubstr("field 'warp': is no number of the profile 'lab', expected one of samples"));
  EXPECT_THAT(refusal({"rates_by_changes", 0, 1}), HasSubstr("is no number of the profile"));
  EXPECT_THAT(refusal({"temperature", 1e-9, 1}), HasSubstr("temperature.min is 1e-09, expected 1e-06 to 1e+06"));
  EXPECT_THAT(refusal({"unseen_speed_factor", 0.1, 3}), HasSubstr("unseen_speed_factor.max is 3, expected 0.05 to 1"));
  EXPECT_THAT(refusal({"temperature", 2, 2}), HasSubstr("less than max"));
  EXPECT_THAT(refusal({"crossing_weight", 0, 2}), HasSubstr("more than 0, or scale: LINEAR"));
  EXPECT_THAT(refusal({"temperature", 2, 4}),
              HasSubstr("the base has 1, expected a range with that in it, not 2 to 4"));
  EXPECT_THAT(Space::make({}, sheet_of()).error(), HasSubstr("there is none"));
  EXPECT_THAT(Space::make({{"temperature", 0.1, 10}, {"temperature", 0.1, 10}}, sheet_of()).error(),
              HasSubstr("stands there twice"));
}

}  // namespace
}  // namespace gatefield::race
