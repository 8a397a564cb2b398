#include "server/operations/health.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace gatefield::operations {
namespace {

using ::testing::HasSubstr;
using namespace std::chrono_literals;

service::Figures made_at(Stamp stamp) {
  service::Figures figures;
  figures.made = figures.step_since = stamp;
  return figures;
}

TEST(Health, IsWellWhileFiguresAreFresh) {
  service::Figures figures = made_at(100s);
  EXPECT_TRUE(health_of(figures, 100s + kHangsAfter).well);
  EXPECT_EQ(health_of(figures, 100s).words, "serves 0 vehicles");
  figures.vehicles.resize(1);
  EXPECT_EQ(health_of(figures, 100s).words, "serves 1 vehicle");
}

TEST(Health, HousekeepingThatHangsIsTold) {
  const Health health = health_of(made_at(100s), 100s + kHangsAfter + 1s);
  EXPECT_FALSE(health.well);
  EXPECT_THAT(health.words, HasSubstr("housekeeping hangs: its newest figures are 6 s old, expected at most 5"));
}

TEST(Health, AStepThatHangsIsTold) {
  service::Figures figures = made_at(100s);
  figures.step_since = 93s;
  const Health health = health_of(figures, 100s);
  EXPECT_FALSE(health.well);
  EXPECT_THAT(health.words, HasSubstr("a control step hangs: it runs for 7 s"));
}

}  // namespace
}  // namespace gatefield::operations
