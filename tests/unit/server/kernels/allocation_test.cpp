// The control step must not allocate: this program counts every call of operator new.

#include <atomic>
#include <cstdlib>
#include <new>

#include "server/kernels/average/average.h"
#include "server/kernels/decoder/decoder.h"
#include "server/kernels/noise/noise.h"
#include "server/kernels/rollout/rollout.h"
#include "tests/unit/server/kernels/every_backend.h"

namespace {

std::atomic<int> allocations{0};

void* counted(std::size_t size, std::size_t alignment) {
  ++allocations;
  // aligned_alloc wants a multiple of the alignment
  void* memory = std::aligned_alloc(alignment, (size + alignment - 1) / alignment * alignment);
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}

}  // namespace

void* operator new(std::size_t size) { return counted(size, alignof(std::max_align_t)); }
void* operator new(std::size_t size, std::align_val_t alignment) {
  return counted(size, static_cast<std::size_t>(alignment));
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::align_val_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept { std::free(memory); }

namespace gatefield::kernels {
namespace {

class AllocationTest : public EveryBackend {};

TEST_P(AllocationTest, TheCounterCounts) {
  const int before = allocations;
  std::vector<float> memory(10);
  EXPECT_EQ(memory.size(), 10u);
  EXPECT_GT(allocations, before);
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

  const int before = allocations;
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
  EXPECT_EQ(allocations, before);
}

ON_EVERY_BACKEND(AllocationTest);

}  // namespace
}  // namespace gatefield::kernels
