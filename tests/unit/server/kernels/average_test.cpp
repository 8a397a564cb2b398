#include "server/kernels/average/average.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "common/base/random.h"
#include "tests/unit/server/kernels/every_backend.h"

namespace gatefield::kernels {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

class AverageTest : public EveryBackend {};

std::vector<float> random_costs(std::size_t count, std::uint64_t seed) {
  Random random(seed);
  std::vector<float> cost(count);
  for (float& J : cost) J = static_cast<float>(random.uniform(5.0, 60.0));
  return cost;
}

TEST_P(AverageTest, WeightsFollowTheReferenceForEveryNumberOfSamples) {
  for (std::size_t count = 1; count <= 67; ++count) {
    // One past the start: spans need no alignment.
    const std::vector<float> memory = random_costs(count + 1, count);
    const std::span<const float> cost(memory.data() + 1, count);
    std::vector<float> weight(count + 1, -1.0f), expected(count);
    const double effective = backend().softmax_weights(cost, 4.0, {weight.data(), count});
    const double expected_effective = softmax_weights_reference(cost, 4.0, expected);
    for (std::size_t m = 0; m < count; ++m)
      ASSERT_NEAR(weight[m], expected[m], 1e-6 + 1e-4 * expected[m]) << m << " of " << count;
    EXPECT_EQ(weight[count], -1.0f) << "wrote past the end";
    EXPECT_NEAR(effective, expected_effective, 1e-4 * expected_effective);
    EXPECT_NEAR(std::accumulate(weight.begin(), weight.end() - 1, 0.0), 1.0, 1e-5);
  }
}

TEST_P(AverageTest, WeightsSumToOneWhateverTheTemperature) {
  const std::vector<float> cost = random_costs(2048, 1);
  std::vector<float> weight(cost.size());
  double last = 0.0;
  for (const double temperature : {0.0, 1e-40, 1e-6, 0.1, 1.0, 10.0, 1e3, 1e12, 1e300}) {
    const double effective = backend().softmax_weights(cost, temperature, weight);
    EXPECT_NEAR(std::accumulate(weight.begin(), weight.end(), 0.0), 1.0, 1e-5) << temperature;
    EXPECT_GE(effective, last * (1 - 1e-5)) << "more temperature, more samples count";
    last = effective;
  }
  EXPECT_NEAR(last, 2048, 0.1);
}

TEST_P(AverageTest, NoTemperatureGivesAllWeightToTheBest) {
  std::vector<float> cost = random_costs(33, 2);
  cost[19] = 1.0f;
  std::vector<float> weight(cost.size());
  EXPECT_DOUBLE_EQ(backend().softmax_weights(cost, 0.0, weight), 1.0);
  for (std::size_t m = 0; m < cost.size(); ++m) EXPECT_EQ(weight[m], m == 19 ? 1.0f : 0.0f);
}

TEST_P(AverageTest, CostsThatAreNoNumbersGetNoWeight) {
  for (const std::size_t place : {0u, 1u, 15u, 16u, 31u, 36u}) {
    for (const float bad : {std::nanf(""), -std::nanf(""), kInfinity, -kInfinity}) {
      std::vector<float> cost = random_costs(37, 3), expected = cost, weight(37), expected_weight(37);
      cost[place] = bad;
      const double effective = backend().softmax_weights(cost, 5.0, weight);
      EXPECT_EQ(weight[place], 0.0f) << place << ", " << bad;
      expected.erase(expected.begin() + static_cast<std::ptrdiff_t>(place));
      EXPECT_NEAR(effective, softmax_weights_reference(expected, 5.0, expected_weight), 1e-3);
      EXPECT_NEAR(std::accumulate(weight.begin(), weight.end(), 0.0), 1.0, 1e-5);
    }
  }
}

TEST_P(AverageTest, NothingFiniteMeansNoWeightsAtAll) {
  for (const float bad : {std::nanf(""), kInfinity, -kInfinity}) {
    for (const std::size_t count : {std::size_t{0}, std::size_t{1}, std::size_t{16}, std::size_t{35}}) {
      const std::vector<float> cost(count, bad);
      std::vector<float> weight(count, 7.0f);
      EXPECT_EQ(backend().softmax_weights(cost, 1.0, weight), 0.0);
      for (const float w : weight) EXPECT_EQ(w, 0.0f);
      EXPECT_EQ(backend().temperature_for(cost, 10, 0.1, 100), 100);
    }
  }
}

TEST_P(AverageTest, ExtremeCostsStayFinite) {
  const std::vector<float> cost{-3e38f, 3e38f, 0.0f, 1e-45f, -1e30f};
  std::vector<float> weight(cost.size());
  for (const double temperature : {0.0, 1e-30, 1.0, 1e30, 1e300}) {
    EXPECT_TRUE(std::isfinite(backend().softmax_weights(cost, temperature, weight)));
    for (const float w : weight) EXPECT_TRUE(w >= 0.0f && w <= 1.0f);
    EXPECT_NEAR(std::accumulate(weight.begin(), weight.end(), 0.0), 1.0, 1e-5);
  }
  EXPECT_TRUE(std::isfinite(backend().temperature_for(cost, 3, 1e-3, 1e3)));
}

TEST_P(AverageTest, FindsTheTemperatureForAnEffectiveSampleSize) {
  const std::vector<float> cost = random_costs(2048, 4);
  std::vector<float> weight(cost.size());
  for (const double target : {5.0, 50.0, 500.0}) {
    const double temperature = backend().temperature_for(cost, target, 1e-3, 1e3);
    EXPECT_NEAR(softmax_weights_reference(cost, temperature, weight), target, 1e-3 * target);
  }
  EXPECT_EQ(backend().temperature_for(cost, 0.5, 0.1, 10.0), 0.1) << "fewer than one is out of reach: the lower end";
  EXPECT_EQ(backend().temperature_for(cost, 1e6, 0.1, 10.0), 10.0) << "more than there are: the upper end";
}

TEST_P(AverageTest, AverageFollowsTheReferenceForEveryNumberOfSamples) {
  constexpr int kSteps = 5;
  for (int samples = 1; samples <= 67; ++samples) {
    Random random(static_cast<std::uint64_t>(samples));
    OwnedBlock inputs(kSteps, kInputs, samples);
    std::vector<float> memory(static_cast<std::size_t>(samples) + 1);
    for (float& w : memory) w = static_cast<float>(random.uniform());
    for (int k = 0; k < kSteps; ++k) {
      for (int i = 0; i < kInputs; ++i) {
        for (int m = 0; m < padded_samples(samples); ++m)
          inputs.at(k, i, m) = static_cast<float>(random.uniform(-30, 30));
      }
    }
    std::vector<double> mean(kSteps * kInputs, 0.25), expected(kSteps * kInputs, 0.25);
    const std::span<const float> weight(memory.data() + 1, static_cast<std::size_t>(samples));
    backend().accumulate_average(weight, inputs.block(), mean.data());
    accumulate_average_reference(weight, inputs.block(), expected.data());
    for (std::size_t i = 0; i < mean.size(); ++i) ASSERT_NEAR(mean[i], expected[i], 1e-10) << samples;
  }
}

ON_EVERY_BACKEND(AverageTest);

}  // namespace
}  // namespace gatefield::kernels
