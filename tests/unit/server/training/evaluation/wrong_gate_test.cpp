#include "server/training/evaluation/wrong_gate.h"

#include <gtest/gtest.h>

#include <cmath>

#include "common/base/random.h"

namespace gatefield::training {
namespace {

TEST(LetThrough, CountsWrongGatesAndPhantoms) {
  const std::vector<Candidate> frames = {{0.9, 0.05, true, 0.02},   // right
                                         {0.9, 0.05, true, 1.5},    // wrong
                                         {0.4, 0.05, true, 2.0},    // wrong, but not valid
                                         {0.9, 0.50, true, 3.0},    // wrong, and predicted to be bad
                                         {0.8, 0.05, false, 0.0},   // phantom
                                         {0.1, 0.05, false, 0.0}};  // rightly empty
  const LetThrough result = let_through(frames, {0.5, 0.2});
  EXPECT_EQ(result.gates_n, 4);
  EXPECT_EQ(result.empty_n, 2);
  EXPECT_EQ(result.kept_n, 2);
  EXPECT_EQ(result.wrong_n, 1);
  EXPECT_EQ(result.phantom_n, 1);
  EXPECT_DOUBLE_EQ(result.kept_percent(), 50.0);
  EXPECT_DOUBLE_EQ(result.wrong_percent(), 50.0);
  EXPECT_NEAR(result.wrong_or_phantom_percent(), 200.0 / 3.0, 1e-12);
}

TEST(LetThrough, NothingLetThroughHasNoPerCent) {
  EXPECT_TRUE(std::isnan(let_through({{0.1, 0.1, true, 0.0}}, {0.5}).wrong_percent()));
}

/// Frames in which the predicted error tells the wrong ones mostly, validity not at all.
std::vector<Candidate> frames_with_wrong_ones(int count) {
  std::vector<Candidate> out;
  Random random(5);
  for (int i = 0; i < count; ++i) {
    const bool wrong = random.chance(0.05);
    out.push_back({random.uniform(0.5, 1.0), wrong ? random.uniform(0.15, 0.5) : random.uniform(0.0, 0.2), true,
                   wrong ? 1.0 : 0.05});
  }
  return out;
}

TEST(BestThresholds, KeepsWhatIsAskedAndLeavesTheWrongOnesOut) {
  const auto frames = frames_with_wrong_ones(2000);
  const LetThrough result = let_through(frames, best_thresholds(frames, 0.7));
  EXPECT_GE(result.kept_percent(), 70.0);
  EXPECT_EQ(result.wrong_n, 0) << "0.15 m tells all wrong ones and keeps three quarters of the rest";
  EXPECT_GT(let_through(frames, {0.5}).wrong_n, 50);
}

TEST(BestThresholds, AsksForTheShareOfFramesWithAGateOnly) {
  std::vector<Candidate> frames = frames_with_wrong_ones(500);
  for (int i = 0; i < 500; ++i) frames.push_back({0.0, 0.0, false, 0.0});
  EXPECT_GE(let_through(frames, best_thresholds(frames, 0.9)).kept_percent(), 90.0);
}

TEST(CrossChecked, CountsEveryFrameOnce) {
  const auto frames = frames_with_wrong_ones(2000);
  const LetThrough result = cross_checked(frames, 0.7);
  EXPECT_EQ(result.gates_n, 2000);
  EXPECT_NEAR(result.kept_percent(), 75.0, 6.0);
  EXPECT_LT(result.wrong_percent(), 1.0);
}

}  // namespace
}  // namespace gatefield::training
