// Speed of the kernels but the decoder with every instruction set of this machine, one core: one MPPI step's worth of
// work per iteration, in the planner's blocks of 128 samples.

#include <benchmark/benchmark.h>

#include <algorithm>
#include <string>
#include <vector>

#include "common/base/random.h"
#include "server/kernels/average/average.h"
#include "server/kernels/isa.h"
#include "server/kernels/noise/noise.h"
#include "server/kernels/rollout/rollout.h"
#include "tests/bench/register.h"

namespace gatefield::kernels {
namespace {

constexpr int kSteps = 20;
constexpr int kBlock = 128;
constexpr double kDt_s = 0.03;
constexpr NoiseShape kShape{{3, 3, 3, 9}, {{{1, -1, -1, 1}, {1, 1, 1, 1}, {1, 1, -1, -1}, {1, -1, 1, -1}}}};

/// Inputs of all samples and the states of one block, as the planner keeps them.
struct Batch {
  explicit Batch(int count)
      : samples(count),
        inputs(static_cast<std::size_t>(count) * kSteps * kInputs),
        states(static_cast<std::size_t>(kBlock) * kSteps * kStateChannels),
        mean(kSteps * kInputs, 0.0f),
        cost(static_cast<std::size_t>(count)),
        weight(static_cast<std::size_t>(count)) {
    Random random(1);
    for (float& J : cost) J = static_cast<float>(random.uniform(0.0, 100.0));
    for (int block = 0; block < count / kBlock; ++block)
      sample(kShape, 1, 1, block * kBlock, mean.data(), inputs_of(block));
  }

  SampleBlock inputs_of(int block) {
    return {inputs.data() + static_cast<std::size_t>(block) * kBlock * kSteps * kInputs, kSteps, kInputs, kBlock,
            kBlock};
  }
  SampleBlock states_of_block() { return {states.data(), kSteps, kStateChannels, kBlock, kBlock}; }

  int samples;
  std::vector<float> inputs, states, mean, cost, weight;
};

QuadrotorState hovering(const QuadrotorModel& model) {
  QuadrotorState start;
  start.v_WB = {6, 0, 0};
  start.thrust_n = start.thrust_command_n = hover_thrust_n(model);
  return start;
}

void bench_noise(benchmark::State& state, int samples) {
  Batch batch(samples);
  std::uint64_t step = 0;
  for (auto _ : state) {
    ++step;
    for (int block = 0; block < samples / kBlock; ++block) {
      sample(kShape, 1, step, block * kBlock, batch.mean.data(), batch.inputs_of(block));
    }
    benchmark::ClobberMemory();
  }
  state.counters["normals/s"] =
      benchmark::Counter(4.0 * kSteps * samples, benchmark::Counter::kIsIterationInvariantRate);
}

void bench_rollout(benchmark::State& state, int samples) {
  Batch batch(samples);
  const QuadrotorModel model;
  const QuadrotorState start = hovering(model);
  for (auto _ : state) {
    for (int block = 0; block < samples / kBlock; ++block) {
      rollout(model, start, kDt_s, batch.inputs_of(block), batch.states_of_block());
    }
    benchmark::ClobberMemory();
  }
  state.counters["steps/s"] = benchmark::Counter(1.0 * kSteps * samples, benchmark::Counter::kIsIterationInvariantRate);
}

void bench_weights(benchmark::State& state, int samples) {
  Batch batch(samples);
  for (auto _ : state) {
    const double temperature = temperature_for(batch.cost, 50, 1e-2, 1e3);
    benchmark::DoNotOptimize(softmax_weights(batch.cost, temperature, batch.weight));
  }
}

void bench_average(benchmark::State& state, int samples) {
  Batch batch(samples);
  softmax_weights(batch.cost, 5.0, batch.weight);
  std::vector<double> mean(kSteps * kInputs);
  for (auto _ : state) {
    std::fill(mean.begin(), mean.end(), 0.0);
    for (int block = 0; block < samples / kBlock; ++block) {
      accumulate_average({batch.weight.data() + block * kBlock, kBlock}, batch.inputs_of(block), mean.data());
    }
    benchmark::DoNotOptimize(mean.data());
  }
}

template <typename Function>
void add(const std::string& name, const std::string& isa, Function function) {
  benchmark::RegisterBenchmark((name + "/" + isa).c_str(), [isa, function](benchmark::State& state) {
    if (const Status status = select_isa(isa); !status.ok()) {
      state.SkipWithError(status.error().c_str());
      return;
    }
    function(state);
  })->Unit(benchmark::kMillisecond);
}

}  // namespace

void register_all_kernels() {
  for (const std::string& isa : available_isas()) {
    for (const int samples : {2048, 8192}) {
      const std::string size = "/M=" + std::to_string(samples);
      add("kernel/noise" + size, isa, [=](benchmark::State& state) { bench_noise(state, samples); });
      add("kernel/rollout" + size, isa, [=](benchmark::State& state) { bench_rollout(state, samples); });
      add("kernel/temperature_and_weights" + size, isa,
          [=](benchmark::State& state) { bench_weights(state, samples); });
      add("kernel/average" + size, isa, [=](benchmark::State& state) { bench_average(state, samples); });
    }
  }
}

}  // namespace gatefield::kernels

void gatefield::bench::register_kernels() { gatefield::kernels::register_all_kernels(); }
