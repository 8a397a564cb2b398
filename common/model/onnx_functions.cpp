#include "common/model/onnx_functions.h"

#include <google/protobuf/unknown_field_set.h>
#include <onnx/defs/parser.h>

#include <cstdint>
#include <map>
#include <stdexcept>
#include <string>
#include <utility>

#include "common/model/onnx_file.h"

namespace gatefield::model {
namespace {

constexpr int kMaxDepth = 16;
/// FunctionProto.attribute_proto (ONNX IR 9): attributes with what they are when a call leaves them out. Debian's
/// libonnx keeps them as an unknown field.
constexpr int kDefaultsField = 11;

/// An operator by others, after its definition on onnx.ai. `defaults` is a node with the attributes that a call may
/// leave out. Groups are normalised as instances, and factors per channel applied as a batch normalisation of mean 0
/// and variance 1: so no definition needs to know a rank or spreads anything, and OpenCV 4.6 runs each.
struct Definition {
  const char* key;
  const char* defaults;
  std::string text;
};
/// All but the end, which depends on whether there is a shift.
constexpr const char* kLayerNormalization = R"(LayerNormalization (x, scale, shift) => (y) {
  rows = Flatten <axis: int = @axis> (x)  sizes = Shape (rows)  one = Constant <value_ints = [1]> ()
  grouping = Concat <axis = 0> (one, sizes)  grouped = Reshape (rows, grouping)
  groups = Shape <start = 0, end = 1> (rows)
  ones = ConstantOfShape <value = float[1] {1.0}> (groups)  zeros = ConstantOfShape (groups)
  normal = InstanceNormalization <epsilon: float = @epsilon> (grouped, ones, zeros)
  again = Reshape (normal, sizes)  columns = Shape <start = 1, end = 2> (rows)
  variance = ConstantOfShape <value = float[1] {1.0}> (columns)  mean = ConstantOfShape (columns)
  factor = Reshape (scale, columns)  shape = Shape (x) )";
constexpr const char* kLayerScaled =
    "  moved = BatchNormalization <epsilon = 0.0> (again, factor, added, mean, variance)  y = Reshape (moved, shape) }";
const Definition kDefinitions[] = {
    {"Gelu", "d = D ()", R"(Gelu (x) => (y) {
      root = Constant <value_float = 1.41421356> ()  one = Constant <value_float = 1.0> ()
      half = Constant <value_float = 0.5> ()
      scaled = Div (x, root)  bent = Erf (scaled)  raised = Add (bent, one)
      doubled = Mul (x, raised)  y = Mul (doubled, half) })"},
    {"Gelu tanh", "d = D ()", R"(Gelu (x) => (y) {
      factor = Constant <value_float = 0.044715> ()  root = Constant <value_float = 0.79788456> ()
      one = Constant <value_float = 1.0> ()  half = Constant <value_float = 0.5> ()
      square = Mul (x, x)  cube = Mul (square, x)  small = Mul (cube, factor)  sum = Add (x, small)
      scaled = Mul (sum, root)  bent = Tanh (scaled)  raised = Add (bent, one)
      doubled = Mul (x, raised)  y = Mul (doubled, half) })"},
    {"Swish", "d = D <alpha = 1.0> ()", R"(Swish (x) => (y) {
      alpha = Constant <value_float: float = @alpha> ()
      scaled = Mul (x, alpha)  gate = Sigmoid (scaled)  y = Mul (x, gate) })"},
    {"Mish", "d = D ()", "Mish (x) => (y) { soft = Softplus (x)  bent = Tanh (soft)  y = Mul (x, bent) }"},
    {"LayerNormalization 2", "d = D <axis = -1, epsilon = 0.00001> ()",
     std::string(kLayerNormalization) + "added = Identity (mean)" + kLayerScaled},
    {"LayerNormalization 3", "d = D <axis = -1, epsilon = 0.00001> ()",
     std::string(kLayerNormalization) + "added = Reshape (shift, columns)" + kLayerScaled},
    // Up to operator set 20 scale and shift are per group, from 21 on per channel.
    {"GroupNormalization 18", "d = D <epsilon = 0.00001> ()", R"(GroupNormalization (x, scale, shift) => (y) {
      groups = Constant <value_int: int = @num_groups> ()  open = Constant <value_ints = [-1]> ()
      same = Constant <value_ints = [0]> ()  list = Reshape (groups, open)
      grouping = Concat <axis = 0> (same, list, open)  grouped = Reshape (x, grouping)
      normal = InstanceNormalization <epsilon: float = @epsilon> (grouped, scale, shift)
      shape = Shape (x)  y = Reshape (normal, shape) })"},
    {"GroupNormalization 21", "d = D <epsilon = 0.00001> ()", R"(GroupNormalization (x, scale, shift) => (y) {
      groups = Constant <value_int: int = @num_groups> ()  open = Constant <value_ints = [-1]> ()
      same = Constant <value_ints = [0]> ()  list = Reshape (groups, open)
      grouping = Concat <axis = 0> (same, list, open)  grouped = Reshape (x, grouping)
      ones = ConstantOfShape <value = float[1] {1.0}> (list)  zeros = ConstantOfShape (list)
      normal = InstanceNormalization <epsilon: float = @epsilon> (grouped, ones, zeros)
      shape = Shape (x)  again = Reshape (normal, shape)  channels = Shape (scale)
      variance = ConstantOfShape <value = float[1] {1.0}> (channels)  mean = ConstantOfShape (channels)
      y = BatchNormalization <epsilon = 0.0> (again, scale, shift, mean, variance) })"},
};

struct Function {
  const onnx::FunctionProto* body = nullptr;
  std::map<std::string, onnx::AttributeProto> defaults;
};

/// Those of kDefinitions by key. A mistake in their text is one of this file's, and throws.
const std::map<std::string, Function>& definitions() {
  static const std::map<std::string, Function> all = [] {
    static std::map<std::string, onnx::FunctionProto> bodies;
    std::map<std::string, Function> made;
    for (const Definition& each : kDefinitions) {
      onnx::NodeProto defaults;
      for (const auto& status : {onnx::OnnxParser::Parse(bodies[each.key], each.text.c_str()),
                                 onnx::OnnxParser::Parse(defaults, each.defaults)})
        if (!status.IsOK()) throw std::logic_error(each.key + std::string(": ") + status.ErrorMessage());
      made[each.key].body = &bodies[each.key];
      for (const auto& attribute : defaults.attribute()) made[each.key].defaults[attribute.name()] = attribute;
    }
    return made;
  }();
  return all;
}

class Inliner {
 public:
  Inliner(const std::filesystem::path& file, const onnx::ModelProto& model)
      : file_(file), opset_(operator_set(model)) {}

  Status know(const onnx::FunctionProto& body) {
    for (const auto& set : body.opset_import()) {
      if (!is_standard(set.domain()) || set.version() == opset_) continue;
      return file_error(file_,
                        "function " + in_quotes(body.name()) + " is written with operator set " +
                            std::to_string(set.version()) + ", the network with " + std::to_string(opset_) +
                            "; expected the same (torch.onnx.export without optimize=False leaves no functions)");
    }
    Function& function = functions_[key_of(body.domain(), body.name())];
    if (function.body != nullptr) return file_error(file_, "defines the function " + in_quotes(body.name()) + " twice");
    function.body = &body;
    const google::protobuf::UnknownFieldSet& fields = onnx::FunctionProto::GetReflection()->GetUnknownFields(body);
    for (int i = 0; i < fields.field_count(); ++i) {
      if (fields.field(i).number() != kDefaultsField) continue;
      onnx::AttributeProto attribute;
      if (fields.field(i).type() != google::protobuf::UnknownField::TYPE_LENGTH_DELIMITED ||
          !safe_to_parse(fields.field(i).length_delimited(), onnx::AttributeProto::descriptor(), &fields_) ||
          !attribute.ParseFromString(fields.field(i).length_delimited()))
        return file_error(file_, "function " + in_quotes(body.name()) + " has a default value that can't be read");
      function.defaults[attribute.name()] = attribute;
    }
    return {};
  }

  Status expand(onnx::NodeProto&& node, int depth) {
    const Function* const function = called_by(node);
    bytes_ += node.ByteSizeLong();
    if (bytes_ > kMaxFileBytes) return too_much(node);
    if (function == nullptr) {
      if (made_.size() >= kMaxNodes) return too_much(node);
      *made_.Add() = std::move(node);
      return {};
    }
    if (depth > kMaxDepth || ++calls_ > kMaxNodes) return too_much(node);
    const onnx::FunctionProto& body = *function->body;
    std::map<std::string, std::string> names{{"", ""}};
    std::map<std::string, onnx::AttributeProto> attributes = function->defaults;
    for (const auto& attribute : node.attribute()) attributes[attribute.name()] = attribute;
    std::string prefix = node.name();
    for (int i = 0; i < body.input_size(); ++i) names[body.input(i)] = i < node.input_size() ? node.input(i) : "";
    for (int i = 0; i < node.output_size() && i < body.output_size(); ++i)  // who reads another one is told so
      if (!node.output(i).empty()) prefix = names[body.output(i)] = node.output(i);
    for (int i = body.input_size(); i < node.input_size(); ++i)
      if (!node.input(i).empty()) return wrong_number(node, body);
    const auto rename = [&](std::string* name) {
      *name = names.emplace(*name, prefix + "/" + *name).first->second;
      bytes_ += name->size();
    };
    for (onnx::NodeProto inner : body.node()) {
      if (bytes_ > kMaxFileBytes) return too_much(node);
      if (inner.name().empty() && inner.output_size() > 0) inner.set_name(inner.output(0));
      inner.set_name((node.name().empty() ? prefix : node.name()) + "/" + inner.name());  // OpenCV wants each once
      for (std::string& name : *inner.mutable_input()) rename(&name);
      for (std::string& name : *inner.mutable_output()) rename(&name);
      onnx::NodeProto bound;
      for (onnx::AttributeProto& attribute : *inner.mutable_attribute()) {
        const auto found = attributes.find(attribute.ref_attr_name());
        if (attribute.ref_attr_name().empty()) {
          *bound.add_attribute() = std::move(attribute);
        } else if (found != attributes.end()) {  // else the operator's own default
          *bound.add_attribute() = found->second;
          bound.mutable_attribute(bound.attribute_size() - 1)->set_name(attribute.name());
        }
      }
      inner.mutable_attribute()->Swap(bound.mutable_attribute());
      if (Status status = expand(std::move(inner), depth + 1); !status) return status;
    }
    return {};
  }

  google::protobuf::RepeatedPtrField<onnx::NodeProto>* made() { return &made_; }

 private:
  static std::string key_of(const std::string& domain, const std::string& name) {
    return (is_standard(domain) ? "" : domain) + "\n" + name;
  }

  const Function* called_by(const onnx::NodeProto& node) const {
    const auto local = functions_.find(key_of(node.domain(), node.op_type()));
    if (local != functions_.end()) return &local->second;
    if (!is_standard(node.domain())) return nullptr;
    std::string key = node.op_type();
    if (key == "GroupNormalization") key += opset_ < 21 ? " 18" : " 21";
    if (key == "LayerNormalization") key += node.input_size() < 3 || node.input(2).empty() ? " 2" : " 3";
    for (const auto& attribute : node.attribute())
      if (attribute.name() == "approximate" && attribute.s() != "none") key += " " + attribute.s();
    const auto found = definitions().find(key);
    return found == definitions().end() ? nullptr : &found->second;
  }

  Error too_much(const onnx::NodeProto& node) const {
    return file_error(file_, "calls functions at node " + in_quotes(node.name()) + " that make more than " +
                                 std::to_string(kMaxNodes) + " nodes or " + std::to_string(kMaxFileBytes) +
                                 " bytes, or call each other without end");
  }
  Error wrong_number(const onnx::NodeProto& node, const onnx::FunctionProto& body) const {
    return file_error(file_, "node " + in_quotes(node.name()) + " (" + in_quotes(body.name()) + ") has " +
                                 std::to_string(node.input_size()) + " inputs, expected at most " +
                                 std::to_string(body.input_size()));
  }

  const std::filesystem::path& file_;
  const int opset_;
  std::map<std::string, Function> functions_;
  google::protobuf::RepeatedPtrField<onnx::NodeProto> made_;
  std::size_t bytes_ = 0;
  int calls_ = 0;
  int fields_ = 0;
};

}  // namespace

Status inline_functions(const std::filesystem::path& file, onnx::ModelProto* model) {
  Inliner inliner(file, *model);
  for (const auto& function : model->functions())
    if (Status status = inliner.know(function); !status) return status;
  for (onnx::NodeProto& node : *model->mutable_graph()->mutable_node())
    if (Status status = inliner.expand(std::move(node), 0); !status) return status;
  model->mutable_graph()->mutable_node()->Swap(inliner.made());
  model->clear_functions();
  return {};
}

}  // namespace gatefield::model
