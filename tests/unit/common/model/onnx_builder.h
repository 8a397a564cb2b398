#pragma once

#include <onnx/onnx_pb.h>

#include <cstring>
#include <string>
#include <utility>
#include <vector>

#include "common/base/random.h"

namespace gatefield::model {

/// Writes small ONNX networks of the bundle's shape, for tests.
class OnnxBuilder {
 public:
  OnnxBuilder() {
    model_.set_ir_version(8);
    model_.add_opset_import()->set_version(13);
    model_.mutable_graph()->set_name("test");
  }

  /// A weight with random numbers, as raw data or as a list.
  OnnxBuilder& weight(const std::string& name, const std::vector<int>& shape, bool raw = true) {
    onnx::TensorProto* tensor = graph().add_initializer();
    tensor->set_name(name);
    tensor->set_data_type(onnx::TensorProto::FLOAT);
    int count = 1;
    for (const int size : shape) {
      tensor->add_dims(size);
      count *= size;
    }
    std::vector<float> values;
    for (int i = 0; i < count; ++i) values.push_back(static_cast<float>(random_.normal()));
    if (raw) {
      tensor->set_raw_data(values.data(), values.size() * sizeof(float));
    } else {
      for (const float value : values) tensor->add_float_data(value);
    }
    return *this;
  }

  OnnxBuilder& dense(const std::string& name, int inputs, int outputs, bool raw = true) {
    return weight(name + ".weight", {outputs, inputs}, raw).weight(name + ".bias", {outputs}, raw);
  }

  OnnxBuilder& node(const std::string& type) {
    onnx::NodeProto* made = graph().add_node();
    made->set_name("node" + std::to_string(graph().node_size()));
    made->set_op_type(type);
    return *this;
  }

  OnnxBuilder& input(const std::string& name, const std::vector<int>& shape) {
    return value(graph().add_input(), name, shape);
  }
  OnnxBuilder& output(const std::string& name, const std::vector<int>& shape) {
    return value(graph().add_output(), name, shape);
  }

  onnx::ModelProto& model() { return model_; }
  onnx::GraphProto& graph() { return *model_.mutable_graph(); }
  onnx::TensorProto& tensor(const std::string& name) {
    for (onnx::TensorProto& tensor : *graph().mutable_initializer()) {
      if (tensor.name() == name) return tensor;
    }
    return *graph().add_initializer();
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

  onnx::ModelProto model_;
  Random random_{1};
};

}  // namespace gatefield::model
