#include <string>

#include "server/perception/learned/network.h"

#if GATEFIELD_DNNL
#include <dlfcn.h>

#include <algorithm>
#include <cmath>
#include <dnnl.hpp>
#include <functional>
#include <map>
#include <stdexcept>

#include "common/model/onnx_graph.h"
#include "server/perception/learned/onednn_loops.h"
#endif

namespace gatefield::perception {

bool onednn_built_in() noexcept { return GATEFIELD_DNNL != 0; }

#if GATEFIELD_DNNL
namespace {

using dnnl::memory;
using Shape = std::vector<std::int64_t>;

/// What can't be mapped: a part of a sentence. Stays inside this file.
struct Refusal : std::runtime_error {
  using std::runtime_error::runtime_error;
};

std::size_t count_of(const Shape& shape) {
  std::size_t count = 1;
  for (const std::int64_t size : shape) count *= static_cast<std::size_t>(size);
  return count;
}

/// oneDNN shares each primitive among OpenMP's threads; perception has one core. The number is the calling thread's
/// own, and other users of OpenMP in it get theirs back.
class OneThread {
 public:
  OneThread() {
    static const auto get = reinterpret_cast<int (*)()>(dlsym(RTLD_DEFAULT, "omp_get_max_threads"));
    static const auto set = reinterpret_cast<void (*)(int)>(dlsym(RTLD_DEFAULT, "omp_set_num_threads"));
    if (get == nullptr || set == nullptr) return;
    set_ = set;
    before_ = get();
    set_(1);
  }
  ~OneThread() {
    if (set_ != nullptr) set_(before_);
  }
  OneThread(const OneThread&) = delete;
  OneThread& operator=(const OneThread&) = delete;

 private:
  void (*set_)(int) = nullptr;
  int before_ = 1;
};

/// The steps of a folded graph, in its order: a primitive a layer, a loop for what lies between, and a reorder wherever
/// one of them wants numbers in another layout than they were left in.
class OneDnnNetwork final : public LoadedNetwork {
 public:
  explicit OneDnnNetwork(const model::Network& network)
      : graph_(network.graph), engine_(dnnl::engine::kind::cpu, 0), stream_(engine_) {
    const OneThread one;
    for (const model::NetworkTensor& tensor : network.inputs) {
      const Numbers numbers =
          std::make_shared<std::vector<float>>(count_of({tensor.shape.begin(), tensor.shape.end()}));
      inputs_[tensor.name] = numbers;
      values_[graph_->slot(tensor.name)].plain = numbers;
    }
    const int output = graph_->slot(network.output.name);
    std::map<int, int> uses;
    for (const model::Node& node : graph_->nodes())
      for (const int slot : node.inputs) ++uses[slot];
    ++uses[output];
    const auto nodes = graph_->nodes();
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      // A ReLU that alone reads a layer becomes a part of it.
      const bool layer = nodes[i].type == "Conv" || nodes[i].type == "Gemm";
      const bool relu = layer && i + 1 < nodes.size() && nodes[i + 1].type == "Relu" &&
                        nodes[i + 1].inputs[0] == nodes[i].outputs[0] && uses[nodes[i].outputs[0]] == 1;
      add(nodes[i], relu ? nodes[i + 1].outputs[0] : nodes[i].outputs[0], relu);
      if (relu) ++i;
    }
    output_ = plain(output);
  }

  std::span<float> input(const std::string& name) override { return *inputs_.at(name); }

  std::optional<std::vector<float>> run(std::size_t size) override {
    const OneThread one;
    for (const auto& step : steps_) step();
    stream_.wait();
    if (output_->size() != size) return std::nullopt;
    if (!std::all_of(output_->begin(), output_->end(), [](float x) { return std::isfinite(x); })) return std::nullopt;
    return *output_;
  }

 private:
  struct Value {
    Numbers plain;  ///< null until something wants it
    memory native;  ///< as a primitive left it
  };

  void add(const model::Node& node, int out, bool relu) {
    if (node.type == "Conv") return convolution(node, out, relu);
    if (node.type == "Gemm") return dense(node, out, relu);
    if (same_numbers(node)) {
      values_[out].plain = plain(node.inputs[0]);
      return;
    }
    const auto loop = loop_of(*graph_, node, [&](int slot) { return plain(slot); });
    if (!loop) throw Refusal(loop.error());
    const Numbers numbers = std::make_shared<std::vector<float>>(count_of(graph_->shape(out)));
    values_[out].plain = numbers;
    steps_.push_back([fill = *loop, numbers] { fill(numbers->data()); });
  }

  /// Whether a node only gives its first input another shape, the same for every image.
  bool same_numbers(const model::Node& node) const {
    for (const char* const type : {"Identity", "Reshape", "Flatten", "Squeeze", "Unsqueeze"}) {
      if (node.type == type)
        return std::all_of(node.inputs.begin() + 1, node.inputs.end(),
                           [&](int slot) { return slot < 0 || graph_->constant(slot) != nullptr; });
    }
    return false;
  }

  static memory::format_tag tag_of(const Shape& shape) {
    if (shape.size() == 4) return memory::format_tag::nchw;
    if (shape.size() == 2) return memory::format_tag::nc;
    throw Refusal("a layer on something of rank " + std::to_string(shape.size()));
  }

  /// A value as row-major numbers; reordered once if a primitive left it otherwise.
  Numbers plain(int slot) {
    Value& value = values_[slot];
    if (value.plain) return value.plain;
    if (const model::Array* const constant = graph_->constant(slot); constant != nullptr) {
      if (constant->integer) throw Refusal("integers where numbers are needed");
      value.plain = std::make_shared<std::vector<float>>(constant->values.begin(), constant->values.end());
      return value.plain;
    }
    const Shape& shape = graph_->shape(slot);
    value.plain = std::make_shared<std::vector<float>>(count_of(shape));
    reorder(value.native, memory({shape, memory::data_type::f32, tag_of(shape)}, engine_, value.plain->data()));
    return value.plain;
  }

  void reorder(memory from, memory to) {
    dnnl::reorder step(from, to);
    steps_.push_back([this, step, from, to]() mutable { step.execute(stream_, from, to); });
  }

  /// A value in the layout that a primitive wants.
  memory native(int slot, const memory::desc& wanted) {
    memory from = values_[slot].native;
    if (!from) {
      const Shape& shape = graph_->shape(slot);
      from = memory({shape, memory::data_type::f32, tag_of(shape)}, engine_, plain(slot)->data());
    }
    if (from.get_desc() == wanted) return from;
    memory to(wanted, engine_);
    reorder(from, to);
    return to;
  }

  /// Weights in the layout that a primitive wants, once and for all.
  memory weights(const Numbers& numbers, const memory::desc& plain_desc, const memory::desc& wanted) {
    memory from(plain_desc, engine_, numbers->data()), to(wanted, engine_);
    dnnl::reorder(from, to).execute(stream_, from, to);
    stream_.wait();
    return to;
  }

  static dnnl::primitive_attr attributes(bool relu) {
    dnnl::primitive_attr attributes;
    if (relu) {
      dnnl::post_ops after;
      after.append_eltwise(1.0f, dnnl::algorithm::eltwise_relu, 0.0f, 0.0f);
      attributes.set_post_ops(after);
    }
    return attributes;
  }

  void layer(const dnnl::primitive& primitive, memory in, memory weight, memory bias, memory out) {
    steps_.push_back([this, primitive, in, weight, bias, out] {
      primitive.execute(stream_,
                        {{DNNL_ARG_SRC, in}, {DNNL_ARG_WEIGHTS, weight}, {DNNL_ARG_BIAS, bias}, {DNNL_ARG_DST, out}});
    });
  }

  void convolution(const model::Node& node, int out, bool relu) {
    if (node.inputs.size() != 3) throw Refusal("Conv without a bias");
    if (graph_->constant(node.inputs[1]) == nullptr || graph_->constant(node.inputs[2]) == nullptr)
      throw Refusal("Conv other than of images with constant weights");
    if (node.integer("group", 1) != 1 || node.integers("dilations", {1, 1}) != Shape{1, 1})
      throw Refusal("Conv with groups or dilations");
    const Shape &in = graph_->shape(node.inputs[0]), &result = graph_->shape(out),
                &weight = graph_->shape(node.inputs[1]), &bias = graph_->shape(node.inputs[2]);
    const Shape pads = node.integers("pads", {0, 0, 0, 0});
    using type = memory::data_type;
    using tag = memory::format_tag;
    const dnnl::convolution_forward::primitive_desc primitive({dnnl::prop_kind::forward_inference,
                                                               dnnl::algorithm::convolution_direct,
                                                               memory::desc(in, type::f32, tag::any),
                                                               memory::desc(weight, type::f32, tag::any),
                                                               memory::desc(bias, type::f32, tag::a),
                                                               memory::desc(result, type::f32, tag::any),
                                                               node.integers("strides", {1, 1}),
                                                               {pads[0], pads[1]},
                                                               {pads[2], pads[3]}},
                                                              attributes(relu), engine_);
    const memory from = native(node.inputs[0], primitive.src_desc());
    const memory to(primitive.dst_desc(), engine_);
    layer(dnnl::convolution_forward(primitive), from,
          weights(plain(node.inputs[1]), {weight, type::f32, tag::oihw}, primitive.weights_desc()),
          memory({bias, type::f32, tag::a}, engine_, plain(node.inputs[2])->data()), to);
    values_[out].native = to;
  }

  void dense(const model::Node& node, int out, bool relu) {
    if (node.inputs.size() != 3 || node.integer("transB", 0) != 1 || node.integer("transA", 0) != 0)
      throw Refusal("Gemm other than x W^T + b");
    if (node.number("alpha", 1.0) != 1.0 || node.number("beta", 1.0) != 1.0) throw Refusal("Gemm with alpha or beta");
    const Shape &in = graph_->shape(node.inputs[0]), &result = graph_->shape(out),
                &weight = graph_->shape(node.inputs[1]), &bias = graph_->shape(node.inputs[2]);
    if (graph_->constant(node.inputs[1]) == nullptr || graph_->constant(node.inputs[2]) == nullptr ||
        bias != Shape{weight[0]})
      throw Refusal("Gemm other than of a row with constant weights");
    using type = memory::data_type;
    using tag = memory::format_tag;
    const dnnl::inner_product_forward::primitive_desc primitive(
        {dnnl::prop_kind::forward_inference, memory::desc(in, type::f32, tag::nc),
         memory::desc(weight, type::f32, tag::any), memory::desc(bias, type::f32, tag::a),
         memory::desc(result, type::f32, tag::nc)},
        attributes(relu), engine_);
    const memory from = native(node.inputs[0], primitive.src_desc());
    const memory to(primitive.dst_desc(), engine_);
    layer(dnnl::inner_product_forward(primitive), from,
          weights(plain(node.inputs[1]), {weight, type::f32, tag::oi}, primitive.weights_desc()),
          memory({bias, type::f32, tag::a}, engine_, plain(node.inputs[2])->data()), to);
    values_[out].native = to;
  }

  std::shared_ptr<const model::Graph> graph_;
  dnnl::engine engine_;
  dnnl::stream stream_;
  std::map<std::string, Numbers> inputs_;
  std::map<int, Value> values_;  ///< by slot
  std::vector<std::function<void()>> steps_;
  Numbers output_;
};

}  // namespace

Result<std::unique_ptr<LoadedNetwork>> onednn_network(const model::Network& network) {
  try {
    return std::unique_ptr<LoadedNetwork>(new OneDnnNetwork(network));
  } catch (const Refusal& refusal) {
    return Error{std::string("oneDNN isn't asked for ") + refusal.what(), ErrorCode::kUnsupported};
  } catch (const dnnl::error& error) {
    return Error{std::string("oneDNN refuses it (") + error.what() + ")", ErrorCode::kUnsupported};
  } catch (const std::exception& error) {
    return Error{std::string("it has something unusual (") + error.what() + ")", ErrorCode::kUnsupported};
  }
}
#else
Result<std::unique_ptr<LoadedNetwork>> onednn_network(const model::Network&) {
  return Error{"this build has no oneDNN", ErrorCode::kUnsupported};
}
#endif

}  // namespace gatefield::perception
