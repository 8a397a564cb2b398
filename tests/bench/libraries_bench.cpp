// The shipped decoders on the same points: ours with every instruction set, and what the usual libraries make of them,
// one core each. Libraries get encoded points (sines and cosines are already taken, which ours does itself) and their
// best case: weights laid out beforehand, 4096 points at a time.

#include <benchmark/benchmark.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iostream>
#include <map>
#include <numbers>

#if GATEFIELD_BENCH_DNNL
#include <dnnl.hpp>
#endif
#if GATEFIELD_BENCH_TORCH
#include <ATen/ATen.h>
#include <ATen/Parallel.h>
#endif

#include "common/base/random.h"
#include "common/geometry/camera.h"
#include "server/kernels/backend.h"
#include "server/perception/learned/depth_encoder.h"
#include "tests/bench/flight.h"
#include "tests/bench/register.h"

namespace gatefield::bench {
namespace {

constexpr std::size_t kQueries = 8192 * 20;
constexpr std::size_t kChunk = 4096;

/// What the first layer sees, [query][input].
std::vector<float> encoded(const DecoderCase& which) {
  const kernels::FoldedDecoder& d = which.folded;
  const int octaves = d.prepared->hyper() ? 0 : which.weights->encoding_octaves;
  std::vector<float> rows;
  for (std::size_t i = 0; i < kQueries; ++i) {
    const Eigen::Vector3f p = d.R_CW * Eigen::Vector3f(which.x[i], which.y[i], which.z[i]) + d.t_CW;
    rows.insert(rows.end(), p.data(), p.data() + 3);
    for (int octave = 0; octave < octaves; ++octave) {
      const double factor = std::numbers::pi * std::exp2(octave) / which.weights->position_scale_m;
      for (int axis = 0; axis < 3; ++axis) rows.push_back(static_cast<float>(std::sin(factor * p[axis])));
      for (int axis = 0; axis < 3; ++axis) rows.push_back(static_cast<float>(std::cos(factor * p[axis])));
    }
  }
  return rows;
}

/// The largest difference from the reference over the first points, so that everybody computes the same.
double worst(const DecoderCase& which, const std::vector<float>& sdf) {
  const std::size_t count = std::min<std::size_t>(2000, sdf.size());
  std::vector<float> reference(count);
  kernels::decode_reference(which.folded, {which.x.data(), count}, {which.y.data(), count}, {which.z.data(), count},
                            reference);
  double largest = 0.0;
  for (std::size_t i = 0; i < count; ++i) largest = std::max(largest, std::abs(double{sdf[i]} - double{reference[i]}));
  return largest;
}

void finish(benchmark::State& state, const DecoderCase& which, const std::vector<float>& sdf) {
  state.counters["MAC/s"] = benchmark::Counter(which.products_per_query * static_cast<double>(kQueries),
                                               benchmark::Counter::kIsIterationInvariantRate);
  state.counters["worst_m"] = worst(which, sdf);
}

void ours(benchmark::State& state, const DecoderCase& which, const kernels::Backend& backend) {
  kernels::FoldedDecoder folded;
  kernels::fold(backend.prepare(*which.weights), which.latent, Eigen::Isometry3d::Identity(), &folded);
  constexpr std::size_t kBlock = 128;
  std::vector<float> sdf(kQueries);
  for (auto _ : state) {
    for (std::size_t n = 0; n < kQueries; n += kBlock)
      folded.decode({which.x.data() + n, kBlock}, {which.y.data() + n, kBlock}, {which.z.data() + n, kBlock},
                    {sdf.data() + n, kBlock});
    benchmark::ClobberMemory();
  }
  finish(state, which, sdf);
}

void eigen(benchmark::State& state, const DecoderCase& which) {
  using Matrix = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  const std::vector<float> rows = encoded(which);
  std::vector<float> sdf(kQueries);
  const auto& layers = which.layers;
  for (auto _ : state) {
    for (std::size_t n = 0; n < kQueries; n += kChunk) {
      Eigen::MatrixXf a =
          Eigen::Map<const Eigen::MatrixXf>(rows.data() + n * layers[0].inputs, layers[0].inputs, kChunk);
      for (std::size_t l = 0; l < layers.size(); ++l) {
        const Eigen::Map<const Matrix> W(layers[l].weight.data(), layers[l].outputs, layers[l].inputs);
        const Eigen::Map<const Eigen::VectorXf> b(layers[l].bias.data(), layers[l].outputs);
        Eigen::MatrixXf next = (W * a).colwise() + b;
        a = l + 1 < layers.size() ? Eigen::MatrixXf(next.cwiseMax(0.0f)) : next;
      }
      std::copy_n(a.data(), kChunk, sdf.data() + n);
    }
    benchmark::ClobberMemory();
  }
  finish(state, which, sdf);
}

#if GATEFIELD_BENCH_DNNL
void onednn(benchmark::State& state, const DecoderCase& which, dnnl::memory::data_type type) {
  using dnnl::memory;
  using tag = memory::format_tag;
  try {
    dnnl::engine engine(dnnl::engine::kind::cpu, 0);
    dnnl::stream stream(engine);
    const auto rows = encoded(which);
    const auto& layers = which.layers;
    const auto dim = [](auto value) { return static_cast<memory::dim>(value); };
    const auto chunk = dim(kChunk);
    struct Step {
      dnnl::inner_product_forward run;
      memory weight, bias, out;
    };
    std::vector<Step> steps;
    std::vector<float> sdf(kQueries);
    memory first({{chunk, layers[0].inputs}, type, tag::nc}, engine);
    memory in = first;
    for (std::size_t l = 0; l < layers.size(); ++l) {
      const bool last = l + 1 == layers.size();
      dnnl::post_ops post;
      if (!last) post.append_eltwise(1.0f, dnnl::algorithm::eltwise_relu, 0.0f, 0.0f);
      dnnl::primitive_attr attributes;
      attributes.set_post_ops(post);
      const dnnl::inner_product_forward::desc description(
          dnnl::prop_kind::forward_inference, in.get_desc(),
          memory::desc({layers[l].outputs, layers[l].inputs}, type, tag::any),
          memory::desc({layers[l].outputs}, memory::data_type::f32, tag::a),
          memory::desc({chunk, layers[l].outputs}, last ? memory::data_type::f32 : type, tag::nc));
      const dnnl::inner_product_forward::primitive_desc primitive(description, attributes, engine);
      memory plain({{layers[l].outputs, layers[l].inputs}, memory::data_type::f32, tag::oi}, engine,
                   const_cast<float*>(layers[l].weight.data()));
      memory weight(primitive.weights_desc(), engine);
      dnnl::reorder(plain, weight).execute(stream, plain, weight);
      memory bias({{layers[l].outputs}, memory::data_type::f32, tag::a}, engine,
                  const_cast<float*>(layers[l].bias.data()));
      memory out(primitive.dst_desc(), engine);
      steps.push_back({dnnl::inner_product_forward(primitive), weight, bias, out});
      in = out;
    }
    memory source({{chunk, layers[0].inputs}, memory::data_type::f32, tag::nc}, engine, nullptr);
    dnnl::reorder convert(source, first);
    for (auto _ : state) {
      for (std::size_t n = 0; n < kQueries; n += kChunk) {
        source.set_data_handle(const_cast<float*>(rows.data()) + n * static_cast<std::size_t>(layers[0].inputs));
        convert.execute(stream, source, first);
        memory a = first;
        for (const Step& step : steps) {
          step.run.execute(stream, {{DNNL_ARG_SRC, a},
                                    {DNNL_ARG_WEIGHTS, step.weight},
                                    {DNNL_ARG_BIAS, step.bias},
                                    {DNNL_ARG_DST, step.out}});
          a = step.out;
        }
        stream.wait();
        std::copy_n(static_cast<const float*>(a.get_data_handle()), kChunk, sdf.data() + n);
      }
      benchmark::ClobberMemory();
    }
    finish(state, which, sdf);
  } catch (const dnnl::error& error) {
    state.SkipWithError(error.what());
  }
}
#endif

#if GATEFIELD_BENCH_TORCH
void torch(benchmark::State& state, const DecoderCase& which, at::ScalarType type) {
  at::set_num_threads(1);
  const at::NoGradGuard no_gradients;
  const auto rows = encoded(which);
  const auto& layers = which.layers;
  std::vector<at::Tensor> weights, biases;
  for (const model::Dense& layer : layers) {
    weights.push_back(
        at::from_blob(const_cast<float*>(layer.weight.data()), {layer.outputs, layer.inputs}).to(type, false, true));
    biases.push_back(at::from_blob(const_cast<float*>(layer.bias.data()), {layer.outputs}).to(type, false, true));
  }
  std::vector<float> sdf(kQueries);
  for (auto _ : state) {
    for (std::size_t n = 0; n < kQueries; n += kChunk) {
      at::Tensor a = at::from_blob(const_cast<float*>(rows.data()) + n * static_cast<std::size_t>(layers[0].inputs),
                                   {static_cast<std::int64_t>(kChunk), layers[0].inputs})
                         .to(type);
      for (std::size_t l = 0; l < layers.size(); ++l) {
        a = at::linear(a, weights[l], biases[l]);
        if (l + 1 < layers.size()) a.relu_();
      }
      const at::Tensor out = a.to(at::kFloat).contiguous();
      std::copy_n(out.data_ptr<float>(), kChunk, sdf.data() + n);
    }
    benchmark::ClobberMemory();
  }
  finish(state, which, sdf);
}
#endif

}  // namespace

const model::Bundle& shipped(const std::string& name) {
  static std::map<std::string, model::Bundle> bundles;
  const auto found = bundles.find(name);
  if (found != bundles.end()) return found->second;
  auto read = model::Bundle::read(std::string(GATEFIELD_SOURCE_DIR "/deploy/models/") + name);
  if (!read) {
    std::cerr << "gatefield-bench: " << read.error() << "\n";
    std::exit(2);
  }
  return bundles.emplace(name, std::move(read).value()).first->second;
}

const std::vector<DecoderCase>& decoder_cases() {
  static const std::vector<DecoderCase> cases = [] {
    std::vector<DecoderCase> made;
    for (const char* name : {"race", "paper"}) {
      const model::Bundle& bundle = shipped(name);
      auto encoder = perception::DepthEncoder::create(bundle);
      if (!encoder) {
        std::cerr << "gatefield-bench: " << encoder.error() << "\n";
        std::exit(2);
      }
      const CameraModel camera = default_camera();
      const auto encoding = encoder.value()->encode(image_of_a_gate(camera), camera, Eigen::Vector3d(-0.2, -0.1, 3.0));
      if (!encoding) {
        std::cerr << "gatefield-bench: model " << name << " encodes nothing where a gate is drawn\n";
        std::exit(2);
      }
      DecoderCase which;
      which.name = name;
      which.weights = &bundle.decoder();
      which.latent.assign(encoding->latent.begin(), encoding->latent.end());
      const auto prepared = kernels::best_backend().prepare(bundle.decoder());
      kernels::fold(prepared, which.latent, Eigen::Isometry3d::Identity(), &which.folded);
      which.layers.push_back(which.folded.first);
      if (!prepared->hyper()) which.layers[0].weight = prepared->point_columns().weight;
      which.layers.insert(which.layers.end(), prepared->inner().begin(), prepared->inner().end());
      Random random(1);
      for (std::size_t i = 0; i < kQueries; ++i) {
        which.x.push_back(static_cast<float>(random.uniform(-2, 2)));
        which.y.push_back(static_cast<float>(random.uniform(-2, 2)));
        which.z.push_back(static_cast<float>(random.uniform(0.5, 6)));
      }
      for (const model::Dense& layer : which.layers)
        which.products_per_query += static_cast<double>(layer.weight.size());
      made.push_back(std::move(which));
    }
    return made;
  }();
  return cases;
}

void register_decoders() {
  for (const DecoderCase& which : decoder_cases()) {
    const auto add = [&](const std::string& who, auto run) {
      benchmark::RegisterBenchmark(("decoder/" + which.name + "/" + who).c_str(), [&which, run](benchmark::State& s) {
        run(s, which);
      })->Unit(benchmark::kMillisecond);
    };
    for (const kernels::Backend* backend : kernels::available_backends())
      add("ours_" + std::string(backend->name()),
          [backend](benchmark::State& s, const DecoderCase& w) { ours(s, w, *backend); });
    add("eigen_fp32", eigen);
#if GATEFIELD_BENCH_DNNL
    add("onednn_fp32", [](benchmark::State& s, const DecoderCase& w) { onednn(s, w, dnnl::memory::data_type::f32); });
    add("onednn_bf16", [](benchmark::State& s, const DecoderCase& w) { onednn(s, w, dnnl::memory::data_type::bf16); });
#endif
#if GATEFIELD_BENCH_TORCH
    add("libtorch_fp32", [](benchmark::State& s, const DecoderCase& w) { torch(s, w, at::kFloat); });
    add("libtorch_bf16", [](benchmark::State& s, const DecoderCase& w) { torch(s, w, at::kBFloat16); });
#endif
  }
}

}  // namespace gatefield::bench
