// The control step must not allocate.

#include "server/kernels/average/average.h"
#include "server/kernels/decoder/decoder.h"
#include "server/kernels/noise/noise.h"
#include "server/kernels/rollout/rollout.h"
#include "tests/support/allocation_trap.h"
#include "tests/unit/server/kernels/every_backend.h"

namespace gatefield::kernels {
namespace {

class AllocationTest : public EveryBackend {};

TEST_P(AllocationTest, TheCounterCounts) {
  const test::AllocationTrap trap;
  std::vector<float> memory(10);
  EXPECT_EQ(memory.size(), 10u);
  EXPECT_GT(trap.count(), 0u);
}

TEST_P(AllocationTest, NoKernelAllocates) {
  constexpr NoiseShape kShape{{1, 1, 1, 1}, {{{1, -1, -1, 1}, {1, 1, 1, 1}, {1, 1, -1, -1}, {1, -1, 1, -1}}}};
  const QuadrotorModel model;
  QuadrotorState start;
  start.thrust_n = start.thrust_command_n = hover_thrust_n(model);
  OwnedBlock inputs(20, kInputs, 100), states(20, kStateChannels, 100);
  const std::vector<float> mean(20 * kInputs);
  std::vector<double> average(20 * kInputs);
  std::vector<float> cost(100, 1.0f), weight(100), sdf(100);

  model::DecoderWeights weights;
  weights.latent_size = 5;
  weights.generator = {2, 4 * 256, std::vector<float>(2 * 4 * 256, 0.1f), std::vector<float>(4 * 256)};
  weights.layers = {{256, 256, std::vector<float>(256 * 256, 0.01f), std::vector<float>(256)},
                    {256, 1, std::vector<float>(256, 0.1f), std::vector<float>(1)}};
  const std::vector<float> latent(5, 0.5f);
  const auto prepared = backend().prepare(weights);
  FoldedDecoder folded, copy;
  fold(prepared, latent, Eigen::Isometry3d::Identity(), &folded);
  copy = folded;

  RateRollout how;
  how.actuation = {Actuation::Kind::kBodyRates, 0.025, {0.04, 0.04, 0.1}};
  how.low = {4.0, -9.0, -9.0, -6.0};
  how.high = {32.0, 9.0, 9.0, 6.0};

  const test::AllocationTrap trap;
  fold(prepared, latent, Eigen::Isometry3d::Identity(), &folded);
  copy = folded;
  copy.place(Eigen::Isometry3d::Identity());
  backend().sample(kShape, 1, 1, 0, mean.data(), inputs.block());
  backend().rollout(model, start, 0.03, inputs.block(), states.block());
  backend().rollout_rates(how, start, hover_command(model), 0.03, inputs.block(), states.block());
  copy.decode({states.block().row(3, kPx), 100}, {states.block().row(3, kPy), 100}, {states.block().row(3, kPz), 100},
              sdf);
  backend().softmax_weights(cost, backend().temperature_for(cost, 10, 0.1, 10), weight);
  backend().accumulate_average(weight, inputs.block(), average.data());
  EXPECT_EQ(trap.count(), 0u);
}

ON_EVERY_BACKEND(AllocationTest);

}  // namespace
}  // namespace gatefield::kernels
