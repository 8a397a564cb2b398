#include "common/model/onnx_simplify.h"

#include <algorithm>
#include <limits>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace gatefield::model {
namespace {

onnx::TensorProto weight_of(const std::string& name, const Array& array) {
  onnx::TensorProto tensor;
  tensor.set_name(name);
  for (const std::int64_t size : array.shape) tensor.add_dims(size);
  if (array.integer) {
    tensor.set_data_type(onnx::TensorProto::INT64);
    for (const double value : array.values)
      tensor.add_int64_data(static_cast<std::int64_t>(std::clamp(value, -9e18, 9e18)));
  } else {
    tensor.set_data_type(onnx::TensorProto::FLOAT);
    const std::vector<float> values(array.values.begin(), array.values.end());
    tensor.set_raw_data(values.data(), values.size() * sizeof(float));
  }
  return tensor;
}

onnx::AttributeProto* add_attribute(onnx::NodeProto* node, const char* name, onnx::AttributeProto::AttributeType type) {
  onnx::AttributeProto* attribute = node->add_attribute();
  attribute->set_name(name);
  attribute->set_type(type);
  return attribute;
}

/// Inputs of `node` that are parameters become attributes. @param constant  the value of an input, null when it varies
template <typename Constant>
void use_attributes(onnx::NodeProto* node, const Graph& graph, const Constant& constant) {
  const std::string& type = node->op_type();
  const bool clip = type == "Clip", split = type == "Split", alike = type == "CastLike";
  if (type == "InstanceNormalization" && node->attribute().empty())  // OpenCV knows no default
    add_attribute(node, "epsilon", onnx::AttributeProto::FLOAT)->set_f(1e-5f);
  if (!clip && !split && !alike && type != "Squeeze" && !type.starts_with("Reduce")) return;
  for (int i = 1; i < node->input_size(); ++i) {
    if (!alike && !node->input(i).empty() && constant(node->input(i)) == nullptr) return;  // computed on the way
  }
  if (std::count(node->output().begin(), node->output().end(), "") > 0) return;
  for (int i = 1; i < node->input_size() && !split && !alike; ++i) {
    const Array* const value = node->input(i).empty() ? nullptr : constant(node->input(i));
    if (value == nullptr) continue;
    if (clip) {
      if (value->values.empty()) continue;
      const double most = std::numeric_limits<float>::max();
      add_attribute(node, i == 1 ? "min" : "max", onnx::AttributeProto::FLOAT)
          ->set_f(static_cast<float>(std::clamp(value->values[0], -most, most)));
    } else {
      onnx::AttributeProto* const list = add_attribute(node, "axes", onnx::AttributeProto::INTS);
      for (const double number : value->values)
        list->add_ints(static_cast<std::int64_t>(std::clamp(number, -9e18, 9e18)));
    }
  }
  if (split) {  // whichever way the file says it
    std::int64_t axis = 0;
    for (const auto& attribute : node->attribute())
      if (attribute.name() == "axis") axis = attribute.i();
    node->clear_attribute();
    add_attribute(node, "axis", onnx::AttributeProto::INT)->set_i(axis);
    onnx::AttributeProto* const list = add_attribute(node, "split", onnx::AttributeProto::INTS);
    for (const std::string& output : node->output()) {
      const auto& shape = graph.shape(graph.slot(output));
      list->add_ints(shape[static_cast<std::size_t>(axis < 0 ? axis + static_cast<std::int64_t>(shape.size()) : axis)]);
    }
  }
  if (alike) node->set_op_type("Identity");  // one that stayed has numbers before and after
  const std::string first = node->input(0);
  node->clear_input();
  node->add_input(first);
}

/// An input or output with the sizes that the graph was folded for.
void add_port(onnx::ValueInfoProto* to, const onnx::ValueInfoProto& from, const Graph& graph) {
  *to = from;
  auto* const shape = to->mutable_type()->mutable_tensor_type()->mutable_shape();
  shape->clear_dim();
  for (const std::int64_t size : graph.shape(graph.slot(from.name()))) shape->add_dim()->set_dim_value(size);
}

}  // namespace

onnx::ModelProto simplified(const onnx::ModelProto& model, const Graph& graph, const std::string& output) {
  const onnx::GraphProto& from = model.graph();
  const auto constant = [&](const std::string& name) { return graph.constant(graph.slot(name)); };

  onnx::ModelProto made;
  made.set_ir_version(model.ir_version());
  made.set_producer_name(model.producer_name());
  *made.mutable_opset_import() = model.opset_import();
  onnx::GraphProto* const to = made.mutable_graph();
  to->set_name(from.name());
  for (const auto& each : from.output())
    if (each.name() == output) add_port(to->add_output(), each, graph);
  std::set<std::string> initializers;
  for (const auto& tensor : from.initializer()) initializers.insert(tensor.name());
  for (const auto& input : from.input()) {
    if (!initializers.contains(input.name())) add_port(to->add_input(), input, graph);
  }
  std::set<std::string> read{output};
  for (const Node& each : graph.nodes()) {
    onnx::NodeProto* const node = to->add_node();
    *node = from.node(each.position);
    node->clear_doc_string();
    use_attributes(node, graph, constant);
    read.insert(node->input().begin(), node->input().end());
  }
  for (const std::string& name : read) {
    if (const Array* const array = constant(name); array != nullptr) *to->add_initializer() = weight_of(name, *array);
  }
  return made;
}

}  // namespace gatefield::model
