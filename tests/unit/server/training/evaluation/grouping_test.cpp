#include "server/training/evaluation/grouping.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "common/base/random.h"

namespace gatefield::training {
namespace {

TEST(Groups, EveryFrameIsInOneGroupOfEachKind) {
  Random random(1);
  for (int i = 0; i < 2000; ++i) {
    const GateFacts gate{random.uniform(0.0, 12.0), random.uniform(0.0, 90.0), random.uniform(0.25, 1.0),
                         1 + static_cast<int>(random.below(4))};
    std::map<std::string, int> in;
    for (const Group& group : groups())
      if (group.holds(gate)) ++in[group.by];
    EXPECT_EQ(in["distance"], 1);
    EXPECT_EQ(in["angle"], 1);
    EXPECT_EQ(in["visibility"], 1);
    EXPECT_EQ(in["gates in view"], 1);
    EXPECT_GE(in["together"], 1);
  }
}

TEST(Groups, LimitsBelongToTheFartherGroup) {
  const auto holds = [](const std::string& name, const GateFacts& gate) {
    for (const Group& group : groups())
      if (group.name == name) return group.holds(gate);
    ADD_FAILURE() << name;
    return false;
  };
  EXPECT_TRUE(holds("2 to 4 m", {2.0, 0.0, 1.0, 1}));
  EXPECT_FALSE(holds("1 to 2 m", {2.0, 0.0, 1.0, 1}));
  EXPECT_TRUE(holds("60 to 80 deg", {2.0, 60.0, 1.0, 1}));
  EXPECT_TRUE(holds("75 to 100 %", {2.0, 60.0, 1.0, 1}));
  EXPECT_TRUE(holds("core", {3.9, 59.0, 0.5, 1}));
  EXPECT_FALSE(holds("core", {4.0, 59.0, 0.5, 1}));
}

TEST(Summarize, MeansMediansAndShares) {
  std::vector<Measured> frames(4);
  const double center_m[] = {0.01, 0.02, 0.03, 4.0};
  for (std::size_t i = 0; i < 4; ++i) {
    frames[i].encoded = true;
    frames[i].fitted = i < 3;
    frames[i].validity = 0.3 * static_cast<double>(i);
    frames[i].box_m = static_cast<double>(i);
    frames[i].center_m = center_m[i];
  }
  frames[3].encoded = false;  // a frame that can't be encoded isn't valid, whatever its number says
  const Summary s = summarize({&frames[0], &frames[1], &frames[2], &frames[3]}, 0.5);
  EXPECT_EQ(s.count, 4);
  EXPECT_DOUBLE_EQ(s.box_m, 1.5);
  EXPECT_DOUBLE_EQ(s.center_median_m, 0.03);
  EXPECT_DOUBLE_EQ(s.center_p90_m, 4.0);
  EXPECT_DOUBLE_EQ(s.fitted_percent, 75.0);
  EXPECT_DOUBLE_EQ(s.valid_percent, 25.0);
}

TEST(ConstantBaselineOfFrames, TakesTheBestConstants) {
  std::vector<FrameTruth> frames(3);
  for (std::size_t i = 0; i < 3; ++i) {
    frames[i].has_gate = true;
    frames[i].center_C = Eigen::Vector3f(0.0f, 0.0f, static_cast<float>(i) + 1.0f);
    frames[i].axis_C = Eigen::Vector3f(i == 0 ? 1.0f : 0.0f, 0.0f, i == 0 ? 0.0f : -1.0f);  // the axis has no sign
    frames[i].prior_m = 0.1 * static_cast<double>(i);
    frames[i].mix_m = {0.0f, static_cast<float>(i)};
    frames[i].near_n = 1;
    frames[i].box_m = {1.0f, -1.0f, 1.0f};
  }
  frames[2].axis_C = Eigen::Vector3f::UnitZ();
  const Constant c = constant_baseline({&frames[0], &frames[1], &frames[2]});
  EXPECT_NEAR(c.center_median_m, 1.0, 1e-6) << "always at 2 m: 1, 0 and 1 m off";
  EXPECT_NEAR(c.normal_median_deg, 0.0, 1e-3) << "always along z: 90, 0 and 0 deg off";
  EXPECT_DOUBLE_EQ(c.prior_median_m, 0.1);
  EXPECT_DOUBLE_EQ(c.near_m, 0.0);
  EXPECT_NEAR(c.sign_percent, 200.0 / 3.0, 1e-9);
  EXPECT_TRUE(std::isnan(constant_baseline({}).box_m));
}

}  // namespace
}  // namespace gatefield::training
