// Speed of the four kernels with every instruction set of this machine, one core: one MPPI step's worth of work per
// iteration, in the planner's blocks of 128 samples. Options are Google Benchmark's, such as
// --benchmark_filter=decode.*avx2.

#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "common/base/random.h"
#include "server/kernels/average/average.h"
#include "server/kernels/decoder/decoder.h"
#include "server/kernels/isa.h"
#include "server/kernels/noise/noise.h"
#include "server/kernels/rollout/rollout.h"

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

struct Network {
  const char* name;
  model::DecoderKind kind;
  std::vector<int> hidden;
  int octaves;
};

const Network kNetworks[] = {{"hyper_3-64-64-1", model::DecoderKind::kHyper, {64, 64}, 0},
                             {"hyper_3-128-128-1", model::DecoderKind::kHyper, {128, 128}, 0},
                             {"concatenated_L5_33-64-64-1", model::DecoderKind::kConcatenated, {64, 64}, 5}};

FoldedDecoder random_decoder(const Network& network) {
  Random random(1);
  const auto dense = [&random](int inputs, int outputs) {
    model::Dense layer{inputs, outputs, {}, {}};
    const double sigma = std::sqrt(2.0 / inputs);
    for (int i = 0; i < inputs * outputs; ++i) layer.weight.push_back(static_cast<float>(sigma * random.normal()));
    for (int i = 0; i < outputs; ++i) layer.bias.push_back(static_cast<float>(0.1 * random.normal()));
    return layer;
  };
  constexpr int kLatent = 32;
  model::DecoderWeights weights;
  weights.kind = network.kind;
  weights.latent_size = kLatent;
  weights.encoding_octaves = network.octaves;
  int inputs = kLatent + 3 + 6 * network.octaves;
  std::size_t first = 0;
  if (network.kind == model::DecoderKind::kHyper) {
    weights.generator = dense(kLatent - 3, 4 * network.hidden[0]);
    inputs = network.hidden[0];
    first = 1;
  }
  for (std::size_t i = first; i < network.hidden.size(); ++i) {
    weights.layers.push_back(dense(inputs, network.hidden[i]));
    inputs = network.hidden[i];
  }
  weights.layers.push_back(dense(inputs, 1));
  FoldedDecoder folded;
  fold(weights, std::vector<float>(kLatent, 0.3f), Eigen::Isometry3d::Identity(), &folded);
  return folded;
}

void bench_decode(benchmark::State& state, const Network& network, int samples) {
  const FoldedDecoder decoder = random_decoder(network);
  const std::size_t count = static_cast<std::size_t>(samples) * kSteps;
  Random random(1);
  std::vector<float> x(count), y(count), z(count), sdf(count);
  for (std::vector<float>* axis : {&x, &y, &z}) {
    for (float& value : *axis) value = static_cast<float>(random.uniform(-4, 4));
  }
  double multiplications = 0;
  for (const model::Dense& layer : decoder.layers) multiplications += static_cast<double>(layer.weight.size());
  for (auto _ : state) {
    for (std::size_t n = 0; n < count; n += kBlock) {
      decode(decoder, {x.data() + n, kBlock}, {y.data() + n, kBlock}, {z.data() + n, kBlock}, {sdf.data() + n, kBlock});
    }
    benchmark::ClobberMemory();
  }
  state.counters["MAC/s"] =
      benchmark::Counter(multiplications * static_cast<double>(count), benchmark::Counter::kIsIterationInvariantRate);
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

void register_all() {
  for (const std::string& isa : available_isas()) {
    for (const int samples : {2048, 8192}) {
      const std::string size = "/M=" + std::to_string(samples);
      add("noise" + size, isa, [=](benchmark::State& state) { bench_noise(state, samples); });
      add("rollout" + size, isa, [=](benchmark::State& state) { bench_rollout(state, samples); });
      add("temperature_and_weights" + size, isa, [=](benchmark::State& state) { bench_weights(state, samples); });
      add("average" + size, isa, [=](benchmark::State& state) { bench_average(state, samples); });
      for (const Network& network : kNetworks) {
        add(std::string("decode/") + network.name + size, isa,
            [=, &network](benchmark::State& state) { bench_decode(state, network, samples); });
      }
    }
  }
}

}  // namespace
}  // namespace gatefield::kernels

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  gatefield::kernels::register_all();
  benchmark::RunSpecifiedBenchmarks();
  benchmark::Shutdown();
  return 0;
}
