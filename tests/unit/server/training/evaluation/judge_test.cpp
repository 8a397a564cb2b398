#include "server/training/evaluation/judge.h"

#include <gtest/gtest.h>

#include <cmath>

#include "server/training/evaluation/selection.h"

namespace gatefield::training {
namespace {

/// Frames at one distance whose errors are all the same, for several bundles.
Evaluation::Set set_of(const std::string& name, DatasetKind kind, double distance_m,
                       const std::vector<double>& errors_m) {
  constexpr std::size_t kFrames = 10;
  Evaluation::Set set;
  set.name = name;
  set.kind = kind;
  FrameTruth truth;
  truth.has_gate = true;
  truth.gate = {distance_m, 10.0, 0.5, 1};
  truth.mix_m = {0.1f};
  truth.box_m = {0.1f};
  set.frames.truth.assign(kFrames, truth);
  for (const double error_m : errors_m) {
    Measured measured;
    measured.encoded = measured.fitted = true;
    measured.validity = 0.9;
    measured.predicted_m = 0.05;
    measured.all_m = measured.box_m = measured.center_m = error_m;
    measured.normal_deg = 1.0;
    measured.sign_percent = 96.0;
    FrameMeasured frame;
    frame.modes = {measured, measured};
    set.frames.measured.emplace_back(kFrames, frame);
  }
  return set;
}

const Target* find(const std::vector<Target>& targets, const std::string& what, const std::string& where) {
  for (const Target& target : targets)
    if (target.what.find(what) != std::string::npos && target.where.find(where) != std::string::npos) return &target;
  ADD_FAILURE() << what << ", " << where;
  return nullptr;
}

TEST(DistanceTargets, ComparesWithTheBarOfTheDistance) {
  Evaluation evaluation;
  evaluation.bundles = {{"new"}};
  evaluation.sets.push_back(set_of("simulation", DatasetKind::kSimulation, 1.5, {0.035}));
  const auto targets = distance_targets(evaluation);
  const Target* all = find(targets, "centre median", "prior, all places, 1 to 2 m");
  ASSERT_NE(all, nullptr);
  EXPECT_EQ(all->count, 10);
  EXPECT_DOUBLE_EQ(all->bar, 0.03);
  EXPECT_FALSE(all->met());
  const Target* half = find(targets, "centre median", "prior, half visible, 1 to 2 m");
  ASSERT_NE(half, nullptr);
  EXPECT_NEAR(half->bar, 0.045, 1e-12) << "half visible: 1.5 times the bar";
  EXPECT_TRUE(half->met());
  const Target* sign = find(targets, "sign mean", "prior, half visible, 1 to 2 m");
  ASSERT_NE(sign, nullptr);
  EXPECT_NEAR(sign->bar, 92.5, 1e-12) << "1.5 times as often wrong";
  const Target* nobody = find(targets, "centre median", "prior, 60 to 80 deg, 1 to 2 m");
  ASSERT_NE(nobody, nullptr);
  EXPECT_FALSE(nobody->met()) << "a figure of no images meets nothing";
}

TEST(OtherTargets, SecondSensorAgainstBothStagesAndSimulation) {
  Evaluation evaluation;
  evaluation.bundles = {{"race"}, {"Stage 1"}, {"x_stage-2"}};
  evaluation.sets.push_back(set_of("simulation", DatasetKind::kSimulation, 3.0, {0.04, 0.03, 0.30}));
  evaluation.sets.push_back(set_of("stereo", DatasetKind::kStereo, 3.0, {0.05, 0.06, 0.10}));
  const auto targets = other_targets(evaluation);
  const Target* first = find(targets, "box error / that of stage 1", "stereo, prior");
  ASSERT_NE(first, nullptr);
  EXPECT_NEAR(first->value, 5.0 / 6.0, 1e-9);
  EXPECT_FALSE(first->met()) << "17 % better is not 20 %";
  const Target* second = find(targets, "box error / that of stage 2", "stereo, prior");
  ASSERT_NE(second, nullptr);
  EXPECT_NEAR(second->value, 0.5, 1e-9);
  EXPECT_TRUE(second->met());
  const Target* simulated = find(targets, "centre, median / that in simulation, 2 to 4 m", "stereo, prior");
  ASSERT_NE(simulated, nullptr);
  EXPECT_NEAR(simulated->value, 1.25, 1e-9);
  EXPECT_TRUE(simulated->met());
}

TEST(Candidates, GateFreeFramesCountInTheFirstLookOnly) {
  Evaluation::Set set = set_of("simulation", DatasetKind::kSimulation, 3.0, {0.04});
  set.frames.truth[0].has_gate = false;
  set.frames.truth[1].has_gate = false;
  set.frames.truth[1].most_visible = 0.1;  // a corner of a gate shows: neither empty nor valid
  EXPECT_EQ(candidates(set.frames, 0, Mode::kPrior).size(), 8u);
  const auto first = candidates(set.frames, 0, Mode::kFirstLook);
  EXPECT_EQ(first.size(), 9u);
  EXPECT_EQ(let_through(first, {0.5}).phantom_n, 1);
  int with = 0, without = 0;
  validity_curve(set.frames, 0, Empty::kNothing, &with, &without);
  EXPECT_EQ(without, 1);
  validity_curve(set.frames, 0, Empty::kNoValid, &with, &without);
  EXPECT_EQ(with, 8);
  EXPECT_EQ(without, 2);
}

}  // namespace
}  // namespace gatefield::training
