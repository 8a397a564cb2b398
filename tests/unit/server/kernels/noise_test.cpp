#include "server/kernels/noise/noise.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tests/unit/server/kernels/every_backend.h"

namespace gatefield::kernels {
namespace {

constexpr NoiseShape kPlain{{1, 1, 1, 1}, {{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}}}};
constexpr NoiseShape kQuadrotor{{3, 2, 2.5, 9}, {{{1, -1, -1, 1}, {1, 1, 1, 1}, {1, 1, -1, -1}, {1, -1, 1, -1}}}};

class NoiseTest : public EveryBackend {};

TEST_P(NoiseTest, FollowsTheReferenceForEveryNumberOfSamples) {
  constexpr int kSteps = 3;
  std::vector<float> mean(kSteps * kInputs);
  for (std::size_t i = 0; i < mean.size(); ++i) mean[i] = 0.5f * static_cast<float>(i) - 2.0f;
  for (int samples = 1; samples <= 67; ++samples) {
    OwnedBlock inputs(kSteps, kInputs, samples), expected(kSteps, kInputs, samples);
    backend().sample(kQuadrotor, 0x123456789abcdefULL, 0xfedcba9876543ULL, 1000, mean.data(), inputs.block());
    sample_reference(kQuadrotor, 0x123456789abcdefULL, 0xfedcba9876543ULL, 1000, mean.data(), expected.block());
    ASSERT_TRUE(inputs.guards_hold());
    // |dn| <= 1e-5 through the four factors of a row, and single precision's rounding of the sum
    constexpr double kTolerance = 1e-5 * (3 + 2 + 2.5 + 9);
    for (int k = 0; k < kSteps; ++k) {
      for (int i = 0; i < kInputs; ++i) {
        for (int m = 0; m < samples; ++m) ASSERT_NEAR(inputs.at(k, i, m), expected.at(k, i, m), kTolerance) << samples;
      }
    }
  }
}

TEST_P(NoiseTest, NormalsAreWithinToleranceOfTheReference) {
  constexpr int kSamples = 20000;
  const std::vector<float> mean(kInputs, 0.0f);
  OwnedBlock inputs(1, kInputs, kSamples), expected(1, kInputs, kSamples);
  backend().sample(kPlain, 42, 1, 1, mean.data(), inputs.block());
  sample_reference(kPlain, 42, 1, 1, mean.data(), expected.block());
  for (int i = 0; i < kInputs; ++i) {
    for (int m = 0; m < kSamples; ++m) ASSERT_NEAR(inputs.at(0, i, m), expected.at(0, i, m), 1e-5);
  }
}

TEST_P(NoiseTest, SameBitsWhateverTheBlocks) {
  constexpr int kSamples = 150;
  const std::vector<float> mean(2 * kInputs, 1.5f);
  OwnedBlock whole(2, kInputs, kSamples);
  backend().sample(kQuadrotor, 9, 77, 0, mean.data(), whole.block());
  for (const int size : {1, 7, 16, 48, 149}) {
    for (int first = 0; first < kSamples; first += size) {
      const int count = std::min(size, kSamples - first);
      OwnedBlock part(2, kInputs, count);
      backend().sample(kQuadrotor, 9, 77, first, mean.data(), part.block());
      for (int k = 0; k < 2; ++k) {
        for (int i = 0; i < kInputs; ++i) {
          for (int m = 0; m < count; ++m) ASSERT_EQ(part.at(k, i, m), whole.at(k, i, first + m));
        }
      }
    }
  }
}

TEST_P(NoiseTest, FirstSampleIsThePlanItself) {
  const std::vector<float> mean{1, -2, 3, -4};
  OwnedBlock inputs(1, kInputs, 20);
  backend().sample(kQuadrotor, 5, 5, 0, mean.data(), inputs.block());
  for (int i = 0; i < kInputs; ++i) {
    EXPECT_EQ(inputs.at(0, i, 0), mean[static_cast<std::size_t>(i)]);
    EXPECT_NE(inputs.at(0, i, 1), mean[static_cast<std::size_t>(i)]);
  }
  backend().sample(kQuadrotor, 5, 5, 16, mean.data(), inputs.block());
  for (int i = 0; i < kInputs; ++i) EXPECT_NE(inputs.at(0, i, 0), mean[static_cast<std::size_t>(i)]);
}

TEST_P(NoiseTest, SeedStepAndTimeAllChangeTheNumbers) {
  const std::vector<float> mean(2 * kInputs, 0.0f);
  OwnedBlock a(2, kInputs, 16), b(2, kInputs, 16);
  backend().sample(kPlain, 1, 1, 1, mean.data(), a.block());
  EXPECT_NE(a.at(0, 0, 3), a.at(1, 0, 3));
  const std::pair<std::uint64_t, std::uint64_t> others[] = {{2, 1}, {1ULL << 32 | 1, 1}, {1, 2}, {1, 1ULL << 32 | 1}};
  for (const auto& [seed, step] : others) {
    backend().sample(kPlain, seed, step, 1, mean.data(), b.block());
    EXPECT_NE(a.at(0, 0, 3), b.at(0, 0, 3)) << seed << ", " << step;
  }
}

TEST_P(NoiseTest, IsStandardNormalAndIndependent) {
  constexpr int kSamples = 2048, kSteps = 20, kBlocks = 4;
  const std::vector<float> mean(kSteps * kInputs, 0.0f);
  OwnedBlock inputs(kSteps, kInputs, kSamples);
  double sum[4] = {}, square[4] = {}, cube[4] = {}, fourth[4] = {}, product[4][4] = {}, next_step[4] = {},
         neighbour[4] = {};
  double within_one_sigma = 0, beyond_three_sigma = 0;
  for (int block = 0; block < kBlocks; ++block) {
    backend().sample(kPlain, 2024, static_cast<std::uint64_t>(block), 1, mean.data(), inputs.block());
    for (int k = 0; k < kSteps; ++k) {
      for (int m = 0; m < kSamples; ++m) {
        for (int i = 0; i < 4; ++i) {
          const double n = inputs.at(k, i, m);
          ASSERT_TRUE(std::isfinite(n));
          sum[i] += n;
          square[i] += n * n;
          cube[i] += n * n * n;
          fourth[i] += n * n * n * n;
          within_one_sigma += std::abs(n) < 1.0;
          beyond_three_sigma += std::abs(n) > 3.0;
          for (int j = 0; j < i; ++j) product[i][j] += n * inputs.at(k, j, m);
          if (k + 1 < kSteps) next_step[i] += n * inputs.at(k + 1, i, m);
          if (m + 1 < kSamples) neighbour[i] += n * inputs.at(k, i, m + 1);
        }
      }
    }
  }
  // Five standard errors each: with N numbers a mean has 1/sqrt(N), a variance sqrt(2/N), a fourth moment sqrt(96/N).
  const double N = double{kSamples} * kSteps * kBlocks;
  for (int i = 0; i < 4; ++i) {
    EXPECT_NEAR(sum[i] / N, 0.0, 5 / std::sqrt(N));
    EXPECT_NEAR(square[i] / N, 1.0, 5 * std::sqrt(2 / N));
    EXPECT_NEAR(cube[i] / N, 0.0, 5 * std::sqrt(15 / N));
    EXPECT_NEAR(fourth[i] / N, 3.0, 5 * std::sqrt(96 / N));
    for (int j = 0; j < i; ++j) EXPECT_NEAR(product[i][j] / N, 0.0, 5 / std::sqrt(N));
    EXPECT_NEAR(next_step[i] / N, 0.0, 5 / std::sqrt(N));
    EXPECT_NEAR(neighbour[i] / N, 0.0, 5 / std::sqrt(N));
  }
  EXPECT_NEAR(within_one_sigma / (4 * N), 0.682689, 0.003);
  EXPECT_NEAR(beyond_three_sigma / (4 * N), 0.0026998, 0.0004);
}

ON_EVERY_BACKEND(NoiseTest);

}  // namespace
}  // namespace gatefield::kernels
