// Speed of the kernels but the decoder with every instruction set of this machine, one core: one MPPI step's worth of
// work per iteration, in the planner's blocks of 128 samples.

#include <benchmark/benchmark.h>

#include <algorithm>
#include <string>
#include <vector>

#include "common/base/random.h"
#include "server/kernels/backend.h"
#include "tests/bench/register.h"

namespace gatefield::kernels {
namespace {

constexpr int kSteps = 20;
constexpr int kBlock = 128;
constexpr double kDt_s = 0.03;
constexpr NoiseShape kShape{{3, 3, 3, 9}, {{{1, -1, -1, 1}, {1, 1, 1, 1}, {1, 1, -1, -1}, {1, -1, 1, -1}}}};

/// Inputs of all samples and the states of one block, as the planner keeps them.
struct Batch {
  Batch(const Backend& backend, int count)
      : samples(count),
        inputs(static_cast<std::size_t>(count) * kSteps * kInputs),
        states(static_cast<std::size_t>(kBlock) * kSteps * kStateChannels),
        mean(kSteps * kInputs, 0.0f),
        cost(static_cast<std::size_t>(count)),
        weight(static_cast<std::size_t>(count)) {
    Random random(1);
    for (float& J : cost) J = static_cast<float>(random.uniform(0.0, 100.0));
    for (int block = 0; block < count / kBlock; ++block)
      backend.sample(kShape, 1, 1, block * kBlock, mean.data(), inputs_of(block));
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

void bench_noise(benchmark::State& state, const Backend& backend, int samples) {
  Batch batch(backend, samples);
  std::uint64_t step = 0;
  for (auto _ : state) {
    ++step;
    for (int block = 0; block < samples / kBlock; ++block) {
      backend.sample(kShape, 1, step, block * kBlock, batch.mean.data(), batch.inputs_of(block));
    }
    benchmark::ClobberMemory();
  }
  state.counters["normals/s"] =
      benchmark::Counter(4.0 * kSteps * samples, benchmark::Counter::kIsIterationInvariantRate);
}

void bench_rollout(benchmark::State& state, const Backend& backend, int samples) {
  Batch batch(backend, samples);
  const QuadrotorModel model;
  const QuadrotorState start = hovering(model);
  for (auto _ : state) {
    for (int block = 0; block < samples / kBlock; ++block) {
      backend.rollout(model, start, kDt_s, batch.inputs_of(block), batch.states_of_block());
    }
    benchmark::ClobberMemory();
  }
  state.counters["steps/s"] = benchmark::Counter(1.0 * kSteps * samples, benchmark::Counter::kIsIterationInvariantRate);
}

void bench_weights(benchmark::State& state, const Backend& backend, int samples) {
  Batch batch(backend, samples);
  for (auto _ : state) {
    const double temperature = backend.temperature_for(batch.cost, 50, 1e-2, 1e3);
    benchmark::DoNotOptimize(backend.softmax_weights(batch.cost, temperature, batch.weight));
  }
}

void bench_average(benchmark::State& state, const Backend& backend, int samples) {
  Batch batch(backend, samples);
  backend.softmax_weights(batch.cost, 5.0, batch.weight);
  std::vector<double> mean(kSteps * kInputs);
  for (auto _ : state) {
    std::fill(mean.begin(), mean.end(), 0.0);
    for (int block = 0; block < samples / kBlock; ++block) {
      backend.accumulate_average({batch.weight.data() + block * kBlock, kBlock}, batch.inputs_of(block), mean.data());
    }
    benchmark::DoNotOptimize(mean.data());
  }
}

}  // namespace

void register_all_kernels() {
  for (const Backend* backend : available_backends()) {
    for (const int samples : {2048, 8192}) {
      const auto add = [&](const std::string& name, void (*run)(benchmark::State&, const Backend&, int)) {
        const std::string full = name + "/M=" + std::to_string(samples) + "/" + std::string(backend->name());
        benchmark::RegisterBenchmark(full.c_str(), [=](benchmark::State& state) {
          run(state, *backend, samples);
        })->Unit(benchmark::kMillisecond);
      };
      add("kernel/noise", bench_noise);
      add("kernel/rollout", bench_rollout);
      add("kernel/temperature_and_weights", bench_weights);
      add("kernel/average", bench_average);
    }
  }
}

}  // namespace gatefield::kernels

void gatefield::bench::register_kernels() { gatefield::kernels::register_all_kernels(); }
