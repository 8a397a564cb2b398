#pragma once

#include <onnx/onnx_pb.h>

#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

#include "common/base/random.h"

namespace gatefield::model {

/// Writes ONNX graphs node by node, for tests. What a node makes is called as the node.
class OnnxBuilder {
 public:
  explicit OnnxBuilder(int opset = 13) {
    model_.set_ir_version(8);
    model_.add_opset_import()->set_version(opset);
    model_.mutable_graph()->set_name("test");
  }

  /// A weight with random numbers (normal, times `scale`), as raw data or as a list.
  OnnxBuilder& weight(const std::string& name, const std::vector<int>& shape, double scale = 0.3, bool raw = true) {
    std::size_t count = 1;
    for (const int size : shape) count *= static_cast<std::size_t>(size);
    std::vector<float> values;
    for (std::size_t i = 0; i < count; ++i) values.push_back(static_cast<float>(scale * random_.normal()));
    return constant(name, shape, values, raw);
  }
  OnnxBuilder& dense(const std::string& name, int inputs, int outputs, bool raw = true) {
    return weight(name + ".weight", {outputs, inputs}, 0.3, raw).weight(name + ".bias", {outputs}, 0.3, raw);
  }
  OnnxBuilder& constant(const std::string& name, const std::vector<int>& shape, const std::vector<float>& values,
                        bool raw = true) {
    onnx::TensorProto* tensor = graph().add_initializer();
    tensor->set_name(name);
    tensor->set_data_type(onnx::TensorProto::FLOAT);
    for (const int size : shape) tensor->add_dims(size);
    if (raw) {
      tensor->set_raw_data(values.data(), values.size() * sizeof(float));
    } else {
      for (const float value : values) tensor->add_float_data(value);
    }
    return *this;
  }
  OnnxBuilder& integers(const std::string& name, const std::vector<std::int64_t>& values, bool scalar = false) {
    onnx::TensorProto* tensor = graph().add_initializer();
    tensor->set_name(name);
    tensor->set_data_type(onnx::TensorProto::INT64);
    if (!scalar) tensor->add_dims(static_cast<std::int64_t>(values.size()));
    for (const std::int64_t value : values) tensor->add_int64_data(value);
    return *this;
  }

  OnnxBuilder& node(const std::string& type, const std::vector<std::string>& inputs, const std::string& name) {
    last_ = graph().add_node();
    last_->set_name(name);
    last_->set_op_type(type);
    for (const std::string& input : inputs) last_->add_input(input);
    last_->add_output(name);
    return *this;
  }
  /// Attributes of the newest node.
  OnnxBuilder& with(const std::string& name, std::int64_t value) {
    attribute(name, onnx::AttributeProto::INT)->set_i(value);
    return *this;
  }
  OnnxBuilder& with(const std::string& name, const std::vector<std::int64_t>& values) {
    onnx::AttributeProto* made = attribute(name, onnx::AttributeProto::INTS);
    for (const std::int64_t value : values) made->add_ints(value);
    return *this;
  }
  OnnxBuilder& with_number(const std::string& name, float value) {
    attribute(name, onnx::AttributeProto::FLOAT)->set_f(value);
    return *this;
  }
  OnnxBuilder& with_word(const std::string& name, const std::string& value) {
    attribute(name, onnx::AttributeProto::STRING)->set_s(value);
    return *this;
  }

  /// y = W x + b with the weights of `layer` (made by dense()).
  OnnxBuilder& gemm(const std::string& input, const std::string& layer, const std::string& name) {
    return node("Gemm", {input, layer + ".weight", layer + ".bias"}, name).with("transB", 1);
  }

  OnnxBuilder& input(const std::string& name, const std::vector<int>& shape) {
    return value(graph().add_input(), name, shape);
  }
  OnnxBuilder& output(const std::string& name, const std::vector<int>& shape) {
    return value(graph().add_output(), name, shape);
  }

  onnx::ModelProto& model() { return model_; }
  onnx::GraphProto& graph() { return *model_.mutable_graph(); }
  /// A weight, a node or an input by name; a new one when there is none, so that a test of it fails.
  onnx::TensorProto& tensor(const std::string& name) {
    auto& all = *graph().mutable_initializer();
    const auto found = std::find_if(all.begin(), all.end(), [&](const auto& t) { return t.name() == name; });
    return found != all.end() ? *found : *all.Add();
  }
  onnx::NodeProto& node(const std::string& name) {
    auto& all = *graph().mutable_node();
    const auto found = std::find_if(all.begin(), all.end(), [&](const auto& n) { return n.name() == name; });
    return found != all.end() ? *found : *all.Add();
  }
  std::string bytes() const { return model_.SerializeAsString(); }

 private:
  /// A size of 0 is left open, under a name.
  OnnxBuilder& value(onnx::ValueInfoProto* info, const std::string& name, const std::vector<int>& shape) {
    info->set_name(name);
    auto* type = info->mutable_type()->mutable_tensor_type();
    type->set_elem_type(onnx::TensorProto::FLOAT);
    for (const int size : shape) {
      auto* dim = type->mutable_shape()->add_dim();
      if (size > 0) {
        dim->set_dim_value(size);
      } else {
        dim->set_dim_param("N");
      }
    }
    return *this;
  }
  onnx::AttributeProto* attribute(const std::string& name, onnx::AttributeProto::AttributeType type) {
    onnx::AttributeProto* made = last_->add_attribute();
    made->set_name(name);
    made->set_type(type);
    return made;
  }

  onnx::ModelProto model_;
  onnx::NodeProto* last_ = nullptr;
  Random random_{1};
};

}  // namespace gatefield::model
