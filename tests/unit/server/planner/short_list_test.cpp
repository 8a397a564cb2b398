#include "server/planner/short_list.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "common/base/random.h"
#include "server/planner/race_guidance.h"
#include "tests/support/analytic_field.h"
#include "tests/unit/server/planner/batch_fixture.h"

namespace gatefield::planner {
namespace {

using test::BatchFixture;

constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// Rollouts that fly straight on from 2 m before a gate at the origin, at speeds of up to `fastest`, spread to all
/// sides.
class ShortListTest : public testing::Test {
 protected:
  ShortListTest() {
    profile_.samples = kBlocks * kBlock;
    profile_.steps = 10;
    profile_.temperature = 0.1;
    input_.start.p_WB = {-2, 0, 0};
    input_.target.field = &field_;
    input_.target.seen = true;
    input_.has_next = true;
    input_.next.center_W = {8, 0, 0};
    Course course;  // heights below the permitted ones, so that each rollout costs something else without the field
    course.waypoints = {{{0, 0, 1.5}, {1, 0, 0}}, {{8, 0, 1.5}, {1, 0, 0}}};
    context_ = RaceGuidance(profile_, QuadrotorModel{}, course, kGuideConeAngle_rad).context(input_);
  }

  BatchFixture straight_on(int block, double fastest_m, double sideways_m) const {
    Random random(static_cast<std::uint64_t>(block) + 1);
    BatchFixture fixture(profile_.steps, kBlock);
    for (int m = 0; m < kBlock; ++m) {
      const Eigen::Vector3f step(static_cast<float>(random.uniform(0, fastest_m)),
                                 static_cast<float>(random.uniform(-sideways_m, sideways_m)),
                                 static_cast<float>(random.uniform(-sideways_m, sideways_m)));
      for (int k = 0; k < profile_.steps; ++k)
        fixture.place(k, m, Eigen::Vector3f(-2, 0, 0) + static_cast<float>(k + 1) * step);
    }
    return fixture;
  }

  std::vector<float> whole(const RolloutCosts& costs, RolloutBatch batch) const {
    std::vector<float> cost(kBlock);
    costs.look_at_fields(input_, context_, workspace(), &batch);
    costs.weigh_without_field(context_, batch, cost);
    costs.add_field(context_, batch, cost);
    return cost;
  }

  static constexpr int kBlocks = 3;
  Profile profile_;
  test::AnalyticField field_{test::upright_gate({0, 0, 0}, 0)};
  PlanInput input_;
  PlanContext context_;
};

TEST_F(ShortListTest, WhoIsOnItCostsTheSameBitForBitAndNobodyElseCouldGetWeight) {
  const RolloutCosts costs(profile_);
  ASSERT_TRUE(costs.bounded_below());
  ShortList list(profile_, &costs);
  std::vector<float> expected;
  for (int block = 0; block < kBlocks; ++block) {
    const BatchFixture fixture = straight_on(block, 0.35, 0.1);
    ASSERT_TRUE(list.bound(context_, block, fixture.batch, workspace()));
    const std::vector<float> cost = whole(costs, fixture.batch);
    expected.insert(expected.end(), cost.begin(), cost.end());
  }
  const std::span<const int> scouts = list.scouts();
  ASSERT_EQ(scouts.size(), std::size_t{kBlocks});
  list.settle(input_, context_, scouts);
  const std::span<const int> chosen = list.choose(profile_.temperature);
  for (std::size_t first = 0; first < chosen.size(); first += 50)
    list.settle(input_, context_, chosen.subspan(first, std::min<std::size_t>(50, chosen.size() - first)));

  float best = kInfinity;
  for (const float J : expected) best = std::min(best, J);
  int left_out = 0;
  for (std::size_t m = 0; m < expected.size(); ++m) {
    if (list.costs()[m] == kInfinity) {
      ++left_out;
      EXPECT_GT(expected[m], best + 20.0 * profile_.temperature) << m;
    } else {
      EXPECT_EQ(list.costs()[m], expected[m]) << m;
    }
  }
  EXPECT_GT(left_out, 50);
  EXPECT_GT(list.settled(), 50);
  EXPECT_EQ(list.settled() + left_out, profile_.samples);
}

TEST_F(ShortListTest, ABlockInWhichARolloutComesBackIsToBeWeighedWhole) {
  const RolloutCosts costs(profile_);
  ShortList list(profile_, &costs);
  BatchFixture fixture = straight_on(0, 0.1, 0.1);
  EXPECT_TRUE(list.bound(context_, 0, fixture.batch, workspace()));
  fixture.place(4, 7, {0.2f, 0, 0});  // through the plane and, with the next state, back
  EXPECT_FALSE(list.bound(context_, 0, fixture.batch, workspace()));
  for (int block = 1; block < kBlocks; ++block)
    ASSERT_TRUE(list.bound(context_, block, straight_on(block, 0.1, 0.1).batch, workspace()));
  list.settle(0, whole(costs, fixture.batch));
  EXPECT_EQ(list.scouts().size(), std::size_t{kBlocks - 1});
  EXPECT_EQ(list.settled(), kBlock);
}

TEST_F(ShortListTest, ThoseThatCrossThePlaneComeLast) {
  const RolloutCosts costs(profile_);
  ShortList list(profile_, &costs);
  for (int block = 0; block < kBlocks; ++block)
    ASSERT_TRUE(list.bound(context_, block, straight_on(block, 0.35, 0.02).batch, workspace()));
  bool crossing = false;
  int changes = 0;
  for (const int m : list.choose(1e3)) {
    const int block = m / kBlock;
    const bool crosses = straight_on(block, 0.35, 0.02).at(profile_.steps - 1, kernels::kPx, m % kBlock) >= 0;
    changes += crosses != crossing ? 1 : 0;
    crossing = crosses;
  }
  EXPECT_EQ(changes, 1);
}

TEST(RolloutCosts, WantFieldsForTheTermsThatLookAtThemAndAreBoundedBelow) {
  EXPECT_TRUE(RolloutCosts(Profile{}).bounded_below());
  EXPECT_TRUE(RolloutCosts(Profile{}).want_fields());
  Profile blind;
  blind.field_weight = blind.crossing_weight = 0;
  EXPECT_FALSE(RolloutCosts(blind).want_fields());
}

}  // namespace
}  // namespace gatefield::planner
