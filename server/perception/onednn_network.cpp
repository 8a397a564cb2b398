#include <dlfcn.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <map>
#include <numeric>
#include <stdexcept>

#include "server/perception/network.h"

#if GATEFIELD_DNNL
#include <onnx/onnx_pb.h>

#include <dnnl.hpp>
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

std::int64_t count_of(const Shape& shape) {
  return std::accumulate(shape.begin(), shape.end(), std::int64_t{1}, std::multiplies<>());
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

 private:
  void (*set_)(int) = nullptr;
  int before_ = 1;
};

struct Value {
  Shape shape;
  std::shared_ptr<std::vector<float>> plain;  ///< row-major; null until something wants it
  memory native;                              ///< as a primitive left it
  std::vector<std::int64_t> integers;         ///< of a constant
  bool constant = false;
};

Shape strides_for(const Shape& shape, const Shape& wide) {
  Shape strides(wide.size(), 0);
  std::int64_t step = 1;
  for (std::size_t i = 0; i < shape.size(); ++i) {
    const std::size_t at = shape.size() - 1 - i, out = wide.size() - 1 - i;
    if (shape[at] != 1) strides[out] = step;
    step *= shape[at];
  }
  return strides;
}

Shape broadcast(const Shape& a, const Shape& b) {
  Shape out(std::max(a.size(), b.size()), 1);
  for (std::size_t i = 0; i < out.size(); ++i) {
    const auto at = [&](const Shape& s) { return i < s.size() ? s[s.size() - 1 - i] : 1; };
    if (at(a) != at(b) && at(a) != 1 && at(b) != 1) throw Refusal("shapes that don't fit together");
    out[out.size() - 1 - i] = std::max(at(a), at(b));
  }
  return out;
}

class OneDnn final : public Network {
 public:
  explicit OneDnn(const model::Network& network) : engine_(dnnl::engine::kind::cpu, 0), stream_(engine_) {
    const OneThread one;
    onnx::ModelProto model;
    if (!model.ParseFromString(*network.bytes)) throw Refusal("a file that can't be read");
    for (const auto& tensor : model.graph().initializer()) constant(tensor);
    for (const model::NetworkTensor& tensor : network.inputs) {
      Value value;
      value.shape.assign(tensor.shape.begin(), tensor.shape.end());
      value.plain = std::make_shared<std::vector<float>>(static_cast<std::size_t>(count_of(value.shape)));
      values_[tensor.name] = value;
    }
    for (const auto& node : model.graph().node())
      for (const std::string& name : node.input()) ++uses_[name];
    ++uses_[network.output.name];
    const auto& nodes = model.graph().node();
    for (int i = 0; i < nodes.size(); ++i) {
      // A ReLU that alone reads a layer becomes a part of it.
      const bool layer = nodes[i].op_type() == "Conv" || nodes[i].op_type() == "Gemm";
      const bool relu = layer && i + 1 < nodes.size() && nodes[i + 1].op_type() == "Relu" &&
                        nodes[i + 1].input(0) == nodes[i].output(0) && uses_[nodes[i].output(0)] == 1;
      add(nodes[i], relu ? nodes[i + 1].output(0) : nodes[i].output(0), relu);
      if (relu) ++i;
    }
    output_ = plain(network.output.name);
  }

  std::span<float> input(const std::string& name) override { return *values_.at(name).plain; }

  std::optional<std::vector<float>> run(std::size_t size) override {
    const OneThread one;
    for (const auto& step : steps_) step();
    stream_.wait();
    if (output_->size() != size) return std::nullopt;
    if (!std::all_of(output_->begin(), output_->end(), [](float x) { return std::isfinite(x); })) return std::nullopt;
    return *output_;
  }

 private:
  using Plain = std::shared_ptr<std::vector<float>>;

  struct Attributes {
    explicit Attributes(const onnx::NodeProto& node) {
      for (const auto& a : node.attribute()) {
        integers[a.name()] = a.has_i() ? Shape{a.i()} : Shape(a.ints().begin(), a.ints().end());
        numbers[a.name()] = a.f();
        words[a.name()] = a.s();
      }
    }
    Shape list(const char* name, Shape otherwise) const {
      const auto found = integers.find(name);
      return found == integers.end() || found->second.empty() ? otherwise : found->second;
    }
    std::map<std::string, Shape> integers;
    std::map<std::string, float> numbers;
    std::map<std::string, std::string> words;
  };

  void constant(const onnx::TensorProto& tensor) {
    Value value;
    value.constant = true;
    value.shape.assign(tensor.dims().begin(), tensor.dims().end());
    const auto count = static_cast<std::size_t>(count_of(value.shape));
    const std::string& raw = tensor.raw_data();
    if (tensor.data_type() == onnx::TensorProto::FLOAT) {
      value.plain = std::make_shared<std::vector<float>>(count);
      if (!raw.empty() && raw.size() == 4 * count)
        std::memcpy(value.plain->data(), raw.data(), raw.size());
      else if (static_cast<std::size_t>(tensor.float_data_size()) == count)
        std::copy(tensor.float_data().begin(), tensor.float_data().end(), value.plain->begin());
      else
        throw Refusal("a weight that isn't whole");
    } else if (tensor.data_type() == onnx::TensorProto::INT64) {
      value.integers.resize(count);
      if (!raw.empty() && raw.size() == 8 * count)
        std::memcpy(value.integers.data(), raw.data(), raw.size());
      else
        value.integers.assign(tensor.int64_data().begin(), tensor.int64_data().end());
      if (value.integers.size() != count) throw Refusal("a constant that isn't whole");
    } else {
      throw Refusal("a constant that is neither float nor int64");
    }
    values_[tensor.name()] = value;
  }

  Value& value(const std::string& name) {
    const auto found = values_.find(name);
    if (found == values_.end()) throw Refusal("'" + name + "', which nothing makes");
    return found->second;
  }

  static memory::format_tag tag_of(std::size_t rank) {
    if (rank == 4) return memory::format_tag::nchw;
    if (rank == 2) return memory::format_tag::nc;
    throw Refusal("a layer on something of rank " + std::to_string(rank));
  }

  /// A value as row-major numbers; reordered once if a primitive left it otherwise.
  Plain plain(const std::string& name) {
    Value& v = value(name);
    if (v.plain) return v.plain;
    if (!v.native) throw Refusal("integers where numbers are needed");
    v.plain = std::make_shared<std::vector<float>>(static_cast<std::size_t>(count_of(v.shape)));
    reorder(v.native, memory({v.shape, memory::data_type::f32, tag_of(v.shape.size())}, engine_, v.plain->data()));
    return v.plain;
  }

  void reorder(memory from, memory to) {
    dnnl::reorder step(from, to);
    steps_.push_back([this, step, from, to]() mutable { step.execute(stream_, from, to); });
  }

  /// A value in the layout that a primitive wants.
  memory native(const std::string& name, const memory::desc& wanted) {
    Value& v = value(name);
    if (v.native && v.native.get_desc() == wanted) return v.native;
    memory from = v.native;
    if (!from) from = memory({v.shape, memory::data_type::f32, tag_of(v.shape.size())}, engine_, plain(name)->data());
    if (from.get_desc() == wanted) return from;
    memory to(wanted, engine_);
    reorder(from, to);
    return to;
  }

  /// Weights in the layout that a primitive wants, once and for all.
  memory weights(const Plain& numbers, const memory::desc& plain_desc, const memory::desc& wanted) {
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

  void conv(const onnx::NodeProto& node, const Attributes& a, const std::string& out, bool relu) {
    if (node.input_size() != 3) throw Refusal("Conv without a bias");
    const Value &weight = value(node.input(1)), &bias = value(node.input(2));
    const Shape in = value(node.input(0)).shape;
    if (!weight.constant || !bias.constant || in.size() != 4 || weight.shape.size() != 4)
      throw Refusal("Conv other than of images with constant weights");
    if (a.list("group", {1})[0] != 1 || a.list("dilations", {1, 1}) != Shape{1, 1})
      throw Refusal("Conv with groups or dilations");
    if (const auto pad = a.words.find("auto_pad"); pad != a.words.end() && pad->second != "NOTSET")
      throw Refusal("Conv with auto_pad");
    const Shape strides = a.list("strides", {1, 1}), pads = a.list("pads", {0, 0, 0, 0});
    const auto size = [&](std::size_t i) {
      return (in[2 + i] + pads[i] + pads[2 + i] - weight.shape[2 + i]) / strides[i] + 1;
    };
    Value made;
    made.shape = {in[0], weight.shape[0], size(0), size(1)};
    using type = memory::data_type;
    using tag = memory::format_tag;
    const dnnl::convolution_forward::primitive_desc primitive({dnnl::prop_kind::forward_inference,
                                                               dnnl::algorithm::convolution_direct,
                                                               memory::desc(in, type::f32, tag::any),
                                                               memory::desc(weight.shape, type::f32, tag::any),
                                                               memory::desc(bias.shape, type::f32, tag::a),
                                                               memory::desc(made.shape, type::f32, tag::any),
                                                               strides,
                                                               {pads[0], pads[1]},
                                                               {pads[2], pads[3]}},
                                                              attributes(relu), engine_);
    const memory from = native(node.input(0), primitive.src_desc());
    made.native = memory(primitive.dst_desc(), engine_);
    layer(dnnl::convolution_forward(primitive), from,
          weights(weight.plain, {weight.shape, type::f32, tag::oihw}, primitive.weights_desc()),
          memory({bias.shape, type::f32, tag::a}, engine_, bias.plain->data()), made.native);
    values_[out] = made;
  }

  void gemm(const onnx::NodeProto& node, const Attributes& a, const std::string& out, bool relu) {
    if (node.input_size() != 3 || a.list("transB", {0})[0] != 1 || a.list("transA", {0})[0] != 0)
      throw Refusal("Gemm other than x W^T + b");
    for (const char* name : {"alpha", "beta"})
      if (const auto found = a.numbers.find(name); found != a.numbers.end() && found->second != 1.0f)
        throw Refusal("Gemm with alpha or beta");
    const Value &weight = value(node.input(1)), &bias = value(node.input(2));
    const Shape in = value(node.input(0)).shape;
    if (!weight.constant || !bias.constant || in.size() != 2 || bias.shape != Shape{weight.shape[0]})
      throw Refusal("Gemm other than of a row with constant weights");
    using type = memory::data_type;
    using tag = memory::format_tag;
    Value made;
    made.shape = {in[0], weight.shape[0]};
    const dnnl::inner_product_forward::primitive_desc primitive(
        {dnnl::prop_kind::forward_inference, memory::desc(in, type::f32, tag::nc),
         memory::desc(weight.shape, type::f32, tag::any), memory::desc(bias.shape, type::f32, tag::a),
         memory::desc(made.shape, type::f32, tag::nc)},
        attributes(relu), engine_);
    const memory from = native(node.input(0), primitive.src_desc());
    made.native = memory(primitive.dst_desc(), engine_);
    layer(dnnl::inner_product_forward(primitive), from,
          weights(weight.plain, {weight.shape, type::f32, tag::oi}, primitive.weights_desc()),
          memory({bias.shape, type::f32, tag::a}, engine_, bias.plain->data()), made.native);
    values_[out] = made;
  }

  /// Makes a row-major result and the loop that fills it.
  template <typename Fill>
  void loop(const std::string& out, const Shape& shape, const Fill& fill) {
    Value made;
    made.shape = shape;
    made.plain = std::make_shared<std::vector<float>>(static_cast<std::size_t>(count_of(shape)));
    values_[out] = made;
    steps_.push_back([fill, to = made.plain] { fill(to->data()); });
  }

  template <typename Operation>
  void elementwise(const onnx::NodeProto& node, const std::string& out, Operation operation) {
    const Shape a = value(node.input(0)).shape, b = value(node.input(1)).shape, wide = broadcast(a, b);
    const Plain x = plain(node.input(0)), y = plain(node.input(1));
    const std::int64_t count = count_of(wide);
    if (a == wide && (b == wide || count_of(b) == 1)) {
      const std::int64_t step = b == wide ? 1 : 0;
      loop(out, wide, [x, y, count, step, operation](float* to) {
        for (std::int64_t i = 0; i < count; ++i) to[i] = operation((*x)[i], (*y)[i * step]);
      });
      return;
    }
    const Shape sa = strides_for(a, wide), sb = strides_for(b, wide);
    loop(out, wide, [x, y, wide, sa, sb, count, operation](float* to) {
      for (std::int64_t i = 0; i < count; ++i) {
        std::int64_t rest = i, ia = 0, ib = 0;
        for (std::size_t d = wide.size(); d-- > 0; rest /= wide[d]) {
          ia += rest % wide[d] * sa[d];
          ib += rest % wide[d] * sb[d];
        }
        to[i] = operation((*x)[ia], (*y)[ib]);
      }
    });
  }

  void pool(const onnx::NodeProto& node, const std::string& out, bool most) {
    const Shape in = value(node.input(0)).shape;
    if (in.size() != 4) throw Refusal("a pool of something that is no image");
    const Plain x = plain(node.input(0));
    const std::int64_t rows = in[0] * in[1], size = in[2] * in[3];
    loop(out, {in[0], in[1], 1, 1}, [x, rows, size, most](float* to) {
      for (std::int64_t r = 0; r < rows; ++r) {
        const float* row = x->data() + r * size;
        float value = most ? row[0] : 0.0f;
        for (std::int64_t i = 0; i < size; ++i) value = most ? std::max(value, row[i]) : value + row[i];
        to[r] = most ? value : value / static_cast<float>(size);
      }
    });
  }

  void resize(const onnx::NodeProto& node, const Attributes& a, const std::string& out) {
    const auto word = [&](const char* name, const char* otherwise) {
      const auto found = a.words.find(name);
      return found == a.words.end() ? std::string(otherwise) : found->second;
    };
    const Shape in = value(node.input(0)).shape;
    if (node.input_size() != 3 || in.size() != 4 || word("mode", "nearest") != "nearest" ||
        word("coordinate_transformation_mode", "half_pixel") != "asymmetric" ||
        word("nearest_mode", "round_prefer_floor") != "floor")
      throw Refusal("Resize other than of images to the nearest, asymmetric, by scales");
    const Value& scales = value(node.input(2));
    if (!scales.constant || !scales.plain || scales.plain->size() != 4) throw Refusal("Resize without constant scales");
    const auto sy = static_cast<std::int64_t>((*scales.plain)[2]), sx = static_cast<std::int64_t>((*scales.plain)[3]);
    if ((*scales.plain)[0] != 1.0f || (*scales.plain)[1] != 1.0f || static_cast<float>(sy) != (*scales.plain)[2] ||
        static_cast<float>(sx) != (*scales.plain)[3] || sy < 1 || sx < 1)
      throw Refusal("Resize by what is no whole number");
    const Plain x = plain(node.input(0));
    loop(out, {in[0], in[1], sy * in[2], sx * in[3]}, [x, in, sy, sx](float* to) {
      const std::int64_t width = sx * in[3];
      for (std::int64_t row = 0; row < in[0] * in[1] * in[2]; ++row) {
        const float* from = x->data() + row * in[3];
        float* first = to + row * sy * width;
        for (std::int64_t i = 0; i < in[3]; ++i) std::fill_n(first + i * sx, sx, from[i]);
        for (std::int64_t again = 1; again < sy; ++again) std::copy_n(first, width, first + again * width);
      }
    });
  }

  void concat(const onnx::NodeProto& node, const Attributes& a, const std::string& out) {
    Shape shape = value(node.input(0)).shape;
    std::int64_t axis = a.list("axis", {0})[0];
    if (axis < 0) axis += static_cast<std::int64_t>(shape.size());
    const auto at = static_cast<std::size_t>(axis);
    std::vector<std::pair<Plain, std::int64_t>> parts;  // numbers, and how many of them side by side
    shape.at(at) = 0;
    std::int64_t outer = 1;
    for (std::size_t i = 0; i < at; ++i) outer *= shape[i];
    for (const std::string& name : node.input()) {
      const Shape part = value(name).shape;
      shape[at] += part.at(at);
      parts.emplace_back(plain(name), count_of(part) / outer);
    }
    loop(out, shape, [parts, outer](float* to) {
      for (std::int64_t o = 0; o < outer; ++o)
        for (const auto& [x, length] : parts) to = std::copy_n(x->data() + o * length, length, to);
    });
  }

  void slice(const onnx::NodeProto& node, const std::string& out) {
    const Shape in = value(node.input(0)).shape;
    if (node.input_size() != 4) throw Refusal("Slice other than with starts, ends and axes");
    const auto &from = value(node.input(1)).integers, &to = value(node.input(2)).integers,
               &axes = value(node.input(3)).integers;
    if (from.size() != 1 || to.size() != 1 || axes.size() != 1) throw Refusal("Slice along several axes");
    const auto at = static_cast<std::size_t>(axes[0] < 0 ? axes[0] + static_cast<std::int64_t>(in.size()) : axes[0]);
    const auto bound = [&](std::int64_t i) {
      return std::clamp<std::int64_t>(i < 0 ? i + in.at(at) : i, 0, in.at(at));
    };
    const std::int64_t begin = bound(from[0]), end = bound(to[0]);
    Shape shape = in;
    shape.at(at) = std::max<std::int64_t>(0, end - begin);
    std::int64_t outer = 1, inner = 1;
    for (std::size_t i = 0; i < at; ++i) outer *= in[i];
    for (std::size_t i = at + 1; i < in.size(); ++i) inner *= in[i];
    const Plain x = plain(node.input(0));
    loop(out, shape, [x, outer, inner, begin, length = shape[at] * inner, row = in[at] * inner](float* result) {
      for (std::int64_t o = 0; o < outer; ++o)
        result = std::copy_n(x->data() + o * row + begin * inner, length, result);
    });
  }

  void transpose(const onnx::NodeProto& node, const Attributes& a, const std::string& out) {
    const Shape in = value(node.input(0)).shape, order = a.list("perm", {});
    if (order.size() != in.size()) throw Refusal("Transpose without perm");
    Shape strides(in.size(), 1), shape(in.size()), steps(in.size());
    for (std::size_t i = in.size(); i-- > 1;) strides[i - 1] = strides[i] * in[i];
    for (std::size_t i = 0; i < in.size(); ++i) {
      shape[i] = in.at(static_cast<std::size_t>(order[i]));
      steps[i] = strides[static_cast<std::size_t>(order[i])];
    }
    const Plain x = plain(node.input(0));
    const std::int64_t count = count_of(in);
    if (order == Shape{0, 2, 1}) {
      loop(out, shape, [x, shape](float* to) {
        const std::int64_t rows = shape[1], columns = shape[2];
        for (std::int64_t image = 0; image < shape[0]; ++image) {
          const float* from = x->data() + image * rows * columns;
          for (std::int64_t r = 0; r < rows; ++r)
            for (std::int64_t c = 0; c < columns; ++c) *to++ = from[c * rows + r];
        }
      });
      return;
    }
    loop(out, shape, [x, shape, steps, count](float* to) {
      for (std::int64_t i = 0; i < count; ++i) {
        std::int64_t rest = i, from = 0;
        for (std::size_t d = shape.size(); d-- > 0; rest /= shape[d]) from += rest % shape[d] * steps[d];
        to[i] = (*x)[from];
      }
    });
  }

  void softmax(const onnx::NodeProto& node, const Attributes& a, const std::string& out) {
    const Shape in = value(node.input(0)).shape;
    const std::int64_t axis = a.list("axis", {-1})[0];
    if (axis != -1 && axis != static_cast<std::int64_t>(in.size()) - 1)
      throw Refusal("Softmax not along the last axis");
    const Plain x = plain(node.input(0));
    const std::int64_t length = in.back(), rows = count_of(in) / length;
    loop(out, in, [x, rows, length](float* to) {
      for (std::int64_t r = 0; r < rows; ++r) {
        const float* row = x->data() + r * length;
        const float most = *std::max_element(row, row + length);
        float sum = 0.0f;
        for (std::int64_t i = 0; i < length; ++i) sum += to[r * length + i] = std::exp(row[i] - most);
        for (std::int64_t i = 0; i < length; ++i) to[r * length + i] /= sum;
      }
    });
  }

  void matmul(const onnx::NodeProto& node, const std::string& out) {
    const Shape a = value(node.input(0)).shape, b = value(node.input(1)).shape;
    if (a.size() != 3 || b.size() != 3 || a[0] != b[0] || a[2] != b[1]) throw Refusal("MatMul other than batched");
    const Plain x = plain(node.input(0)), y = plain(node.input(1));
    loop(out, {a[0], a[1], b[2]}, [x, y, a, columns = b[2]](float* to) {
      for (std::int64_t row = 0; row < a[0] * a[1]; ++row) {
        float* sum = to + row * columns;
        std::fill_n(sum, columns, 0.0f);
        const float* matrix = y->data() + row / a[1] * a[2] * columns;
        for (std::int64_t k = 0; k < a[2]; ++k) {
          const float factor = (*x)[row * a[2] + k];
          for (std::int64_t c = 0; c < columns; ++c) sum[c] += factor * matrix[k * columns + c];
        }
      }
    });
  }

  /// The same numbers under another shape.
  void reshape(const onnx::NodeProto& node, const std::string& out) {
    Value made;
    made.plain = plain(node.input(0));
    made.shape = value(node.input(0)).shape;
    if (node.op_type() == "Reshape") {
      const Shape in = made.shape, wanted = value(node.input(1)).integers;
      std::int64_t known = 1;
      made.shape = wanted;
      for (std::size_t i = 0; i < wanted.size(); ++i) {
        if (wanted[i] == 0) made.shape[i] = in.at(i);
        if (made.shape[i] > 0) known *= made.shape[i];
      }
      for (std::int64_t& size : made.shape)
        if (size < 0) size = count_of(in) / known;
      if (count_of(made.shape) != count_of(in)) throw Refusal("Reshape to another size");
    }
    values_[out] = made;
  }

  void add(const onnx::NodeProto& node, const std::string& out, bool relu) {
    const Attributes a(node);
    const std::string& type = node.op_type();
    if (type == "Conv") return conv(node, a, out, relu);
    if (type == "Gemm") return gemm(node, a, out, relu);
    if (type == "Add") return elementwise(node, out, [](float x, float y) { return x + y; });
    if (type == "Mul") return elementwise(node, out, [](float x, float y) { return x * y; });
    if (type == "GlobalAveragePool" || type == "GlobalMaxPool") return pool(node, out, type == "GlobalMaxPool");
    if (type == "Resize") return resize(node, a, out);
    if (type == "Concat") return concat(node, a, out);
    if (type == "Slice") return slice(node, out);
    if (type == "Transpose") return transpose(node, a, out);
    if (type == "Softmax") return softmax(node, a, out);
    if (type == "MatMul") return matmul(node, out);
    if (type == "Reshape" || type == "Identity") return reshape(node, out);
    if (type == "Relu") {
      const Plain x = plain(node.input(0));
      return loop(out, value(node.input(0)).shape, [x](float* to) {
        for (std::size_t i = 0; i < x->size(); ++i) to[i] = std::max((*x)[i], 0.0f);
      });
    }
    throw Refusal(type);
  }

  dnnl::engine engine_;
  dnnl::stream stream_;
  std::map<std::string, Value> values_;
  std::map<std::string, int> uses_;
  std::vector<std::function<void()>> steps_;
  Plain output_;
};

}  // namespace

Result<std::unique_ptr<Network>> onednn_network(const model::Network& network) {
  try {
    return std::unique_ptr<Network>(new OneDnn(network));
  } catch (const Refusal& refusal) {
    return Error{std::string("oneDNN isn't asked for ") + refusal.what()};
  } catch (const dnnl::error& error) {
    return Error{std::string("oneDNN refuses it (") + error.what() + ")"};
  } catch (const std::exception& error) {
    return Error{std::string("it has something unusual (") + error.what() + ")"};
  }
}
#else
Result<std::unique_ptr<Network>> onednn_network(const model::Network&) { return Error{"this build has no oneDNN"}; }
#endif

}  // namespace gatefield::perception
