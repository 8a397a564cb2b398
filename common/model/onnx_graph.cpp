#include "common/model/onnx_graph.h"

#include <onnx/onnx_pb.h>

#include <algorithm>
#include <set>
#include <utility>

#include "common/model/onnx_file.h"
#include "common/model/onnx_operators.h"

namespace gatefield::model {
namespace {

/// Reading costs time too: inputs that all nodes together go through, as a multiple of the numbers that may be made.
constexpr std::int64_t kReadsPerNumber = 64;

Result<Attribute> attribute_of(const std::filesystem::path& file, const std::string& node,
                               const onnx::AttributeProto& proto) {
  Attribute attribute;
  attribute.integer = proto.i();
  attribute.number = static_cast<double>(proto.f());
  attribute.word = proto.s();
  attribute.integers.assign(proto.ints().begin(), proto.ints().end());
  if (proto.has_t()) {
    Result<Array> array = array_of(file, "the tensor in node " + in_quotes(node), proto.t());
    if (!array) return array.failure();
    attribute.array = std::make_shared<const Array>(std::move(array).value());
  }
  return attribute;
}

/// What a Constant node holds; empty when it holds something else than numbers.
std::shared_ptr<const Array> constant_of(const Node& node, const onnx::NodeProto& proto) {
  for (const onnx::AttributeProto& attribute : proto.attribute()) {
    const auto list = [](const auto& values, bool integer) {
      return std::make_shared<Array>(Array{{values.size()}, {values.begin(), values.end()}, integer});
    };
    const Attribute& read = node.attributes.at(attribute.name());
    if (attribute.name() == "value") return read.array;
    if (attribute.name() == "value_float") return std::make_shared<Array>(Array{{}, {read.number}, false});
    if (attribute.name() == "value_int")
      return std::make_shared<Array>(Array{{}, {static_cast<double>(read.integer)}, true});
    if (attribute.name() == "value_floats") return list(attribute.floats(), false);
    if (attribute.name() == "value_ints") return list(attribute.ints(), true);
  }
  return nullptr;
}

std::string node_text(const Node& node) { return "node " + in_quotes(node.name) + " (" + node.type + ")"; }

}  // namespace

std::int64_t Node::integer(const char* attribute, std::int64_t otherwise) const {
  const auto found = attributes.find(attribute);
  return found == attributes.end() ? otherwise : found->second.integer;
}
double Node::number(const char* attribute, double otherwise) const {
  const auto found = attributes.find(attribute);
  return found == attributes.end() ? otherwise : found->second.number;
}
std::string Node::word(const char* attribute, const char* otherwise) const {
  const auto found = attributes.find(attribute);
  return found == attributes.end() ? otherwise : found->second.word;
}
std::vector<std::int64_t> Node::integers(const char* attribute, std::vector<std::int64_t> otherwise) const {
  const auto found = attributes.find(attribute);
  if (found != attributes.end()) return found->second.integers;
  return otherwise;
}

Result<Graph> Graph::compile(const std::filesystem::path& file, const onnx::ModelProto& model) {
  Graph graph;
  graph.file_ = file;
  graph.opset_ = model::operator_set(model);
  const auto define = [&](const std::string& name) {
    const int slot = static_cast<int>(graph.slots_.size());
    return graph.slots_.emplace(name, slot).second ? slot : -1;
  };
  for (const onnx::TensorProto& tensor : model.graph().initializer()) {
    const int slot = define(tensor.name());
    if (slot < 0) return file_error(file, "tensor " + in_quotes(tensor.name()) + " is there twice");
    Result<Array> array = array_of(file, "tensor " + in_quotes(tensor.name()), tensor);
    if (!array) return array.failure();
    graph.constants_[slot] = std::make_shared<const Array>(std::move(array).value());
  }
  for (const onnx::ValueInfoProto& input : model.graph().input()) {
    if (const int slot = define(input.name()); slot >= 0) graph.inputs_.push_back(slot);  // else an initializer again
  }

  for (int position = 0; position < model.graph().node_size(); ++position) {
    const onnx::NodeProto& proto = model.graph().node(position);
    Node node;
    node.position = position;
    node.name = !proto.name().empty() ? proto.name() : proto.output_size() > 0 ? proto.output(0) : "";
    const Operator* const known = find_operator(proto.op_type());
    if (known == nullptr)
      return file_error(file, "node " + in_quotes(node.name) + " is of an operator that can't be evaluated");
    node.type = proto.op_type();
    node.known = known;
    const auto inputs = static_cast<std::size_t>(proto.input_size()),
               outputs = static_cast<std::size_t>(proto.output_size());
    if (inputs < known->min_inputs || inputs > known->max_inputs || outputs < 1 || outputs > known->max_outputs) {
      return file_error(file, node_text(node) + " has " + std::to_string(inputs) + " inputs and " +
                                  std::to_string(outputs) + " outputs, expected " + std::to_string(known->min_inputs) +
                                  " to " + std::to_string(known->max_inputs) + " and 1" +
                                  (known->max_outputs > 1 ? " to " + std::to_string(known->max_outputs) : ""));
    }
    for (const onnx::AttributeProto& attribute : proto.attribute()) {
      if (known->attributes.find(" " + attribute.name() + " ") == std::string_view::npos || attribute.name().empty()) {
        return file_error(file, node_text(node) + " has the attribute " + in_quotes(attribute.name()) + ", expected " +
                                    (known->attributes == " " ? "none" : "only" + std::string(known->attributes)));
      }
      Result<Attribute> read = attribute_of(file, node.name, attribute);
      if (!read) return read.failure();
      if (!node.attributes.emplace(attribute.name(), std::move(read).value()).second)
        return file_error(file, node_text(node) + " has the attribute " + in_quotes(attribute.name()) + " twice");
    }
    for (const std::string& input : proto.input()) {
      const auto found = graph.slots_.find(input);
      if (!input.empty() && found == graph.slots_.end()) {
        return file_error(file, node_text(node) + " reads " + in_quotes(input) + ", which nothing before it makes");
      }
      node.inputs.push_back(input.empty() ? -1 : found->second);
    }
    for (const std::string& output : proto.output()) {
      const int slot = output.empty() ? -1 : define(output);
      if (slot < 0 && !output.empty())
        return file_error(file, node_text(node) + " makes " + in_quotes(output) + " a second time");
      node.outputs.push_back(slot);
    }
    if (node.type == "Constant") {
      auto constant = constant_of(node, proto);
      if (constant == nullptr) return file_error(file, node_text(node) + " holds no numbers");
      if (node.outputs[0] >= 0) graph.constants_[node.outputs[0]] = std::move(constant);
    } else {
      graph.nodes_.push_back(std::move(node));
    }
  }
  return graph;
}

int Graph::slot(const std::string& name) const {
  const auto found = slots_.find(name);
  return found == slots_.end() ? -1 : found->second;
}

const Array* Graph::constant(int slot) const {
  const auto found = constants_.find(slot);
  return found == constants_.end() ? nullptr : found->second.get();
}

Graph Graph::folded(const Evaluation& evaluation, int output) const {
  const auto at = [](int slot) { return static_cast<std::size_t>(slot); };
  std::vector<bool> varying(slots_.size(), false), needed(slots_.size(), false);
  for (const int slot : inputs_) varying[at(slot)] = true;
  for (const Node& node : nodes_) {
    if (node.type == "Shape") continue;  // the same for every image
    const auto read =
        node.inputs.begin() + (node.type == "CastLike" ? 1 : static_cast<std::ptrdiff_t>(node.inputs.size()));
    const bool varies =
        std::any_of(node.inputs.begin(), read, [&](int slot) { return slot >= 0 && varying[at(slot)]; });
    for (const int slot : node.outputs)
      if (slot >= 0) varying[at(slot)] = varies;
  }
  Graph graph;
  graph.file_ = file_;
  graph.opset_ = opset_;
  graph.slots_ = slots_;
  graph.inputs_ = inputs_;
  if (output >= 0) needed[at(output)] = true;
  for (std::size_t i = nodes_.size(); i-- > 0;) {
    const Node& node = nodes_[i];
    if (std::none_of(node.outputs.begin(), node.outputs.end(),
                     [&](int slot) { return slot >= 0 && varying[at(slot)] && needed[at(slot)]; }))
      continue;
    for (const int slot : node.inputs)
      if (slot >= 0) needed[at(slot)] = true;
    graph.nodes_.push_back(node);
  }
  std::reverse(graph.nodes_.begin(), graph.nodes_.end());
  graph.shapes_.resize(slots_.size());
  for (std::size_t slot = 0; slot < slots_.size(); ++slot) {
    const Array* const value = evaluation.values[slot];
    if (value == nullptr) continue;
    graph.shapes_[slot] = value->shape;
    if (!needed[slot] || varying[slot]) continue;
    const auto known = constants_.find(static_cast<int>(slot));
    graph.constants_[static_cast<int>(slot)] =
        known != constants_.end() ? known->second : std::make_shared<const Array>(*value);
  }
  return graph;
}

Result<Evaluation> Graph::evaluate(const std::map<std::string, Array>& inputs, const Limits& limits,
                                   const std::map<int, Array>& replaced) const {
  Evaluation evaluation;
  evaluation.values.assign(slots_.size(), nullptr);
  const auto keep = [&](int slot, std::unique_ptr<Array> array) {
    evaluation.made.push_back(std::move(array));
    evaluation.values[static_cast<std::size_t>(slot)] = evaluation.made.back().get();
  };
  for (const auto& [slot, array] : constants_) evaluation.values[static_cast<std::size_t>(slot)] = array.get();
  for (const auto& [name, array] : inputs) {
    if (const int found = slot(name); found >= 0) keep(found, std::make_unique<Array>(array));
  }
  Limits left = limits;
  std::int64_t reads = limits.numbers * kReadsPerNumber;
  for (const Node& node : nodes_) {
    if (std::any_of(node.outputs.begin(), node.outputs.end(), [&](int slot) { return replaced.contains(slot); })) {
      for (const int slot : node.outputs) {
        if (const auto found = replaced.find(slot); found != replaced.end())
          keep(slot, std::make_unique<Array>(found->second));
      }
      continue;
    }
    Call call{node, opset_, {}, {}, left};
    call.out.resize(node.outputs.size());
    try {
      for (const int slot : node.inputs) {
        const Array* const array = slot < 0 ? nullptr : evaluation.values[static_cast<std::size_t>(slot)];
        if (slot >= 0 && array == nullptr) throw Refusal("reads an input of the graph that nobody feeds");
        if (array != nullptr) reads -= static_cast<std::int64_t>(array->values.size());
        call.in.push_back(array);
      }
      if (reads < 0) throw Refusal("reads more numbers than a network of this kind should");
      node.known->operation(call);
    } catch (const Refusal& refusal) {
      return file_error(file_, node_text(node) + " " + refusal.what());
    }
    left = call.left;
    for (std::size_t i = 0; i < node.outputs.size(); ++i) {
      if (node.outputs[i] >= 0 && call.out[i] != nullptr) keep(node.outputs[i], std::move(call.out[i]));
    }
  }
  evaluation.multiply_adds = limits.multiply_adds - left.multiply_adds;
  return evaluation;
}

}  // namespace gatefield::model
