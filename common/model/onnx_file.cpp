#include "common/model/onnx_file.h"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/wire_format_lite.h>

#include <algorithm>
#include <set>
#include <utility>

#include "common/model/onnx_functions.h"
#include "common/model/onnx_graph.h"

namespace gatefield::model {
namespace {

namespace pb = google::protobuf;

/// Fields in a whole file. Parsed elements take far more memory than their bytes, so that a small file of empty ones
/// could take gigabytes; networks of ours have some thousands.
constexpr int kMaxFields = 200'000;
constexpr int kMaxDepth = 32;
constexpr int kMaxTensors = 2000;
/// What torch.onnx.export has written since PyTorch 1.5.
constexpr int kOldestOperators = 11;
constexpr int kNewestOperators = 21;

/// Walks the wire format along the schema and counts fields, without building anything.
bool count_fields(pb::io::CodedInputStream* in, const pb::Descriptor* type, int depth, int* fields) {
  using Wire = pb::internal::WireFormatLite;
  if (depth > kMaxDepth) return false;
  while (const std::uint32_t tag = in->ReadTag()) {
    if (++*fields > kMaxFields) return false;
    const pb::FieldDescriptor* field =
        type == nullptr ? nullptr : type->FindFieldByNumber(Wire::GetTagFieldNumber(tag));
    switch (Wire::GetTagWireType(tag)) {
      case Wire::WIRETYPE_VARINT: {
        std::uint64_t value = 0;
        if (!in->ReadVarint64(&value)) return false;
        break;
      }
      case Wire::WIRETYPE_FIXED64:
        if (!in->Skip(8)) return false;
        break;
      case Wire::WIRETYPE_FIXED32:
        if (!in->Skip(4)) return false;
        break;
      case Wire::WIRETYPE_LENGTH_DELIMITED: {
        std::uint32_t length = 0;
        if (!in->ReadVarint32(&length) || length > kMaxFileBytes) return false;
        if (field != nullptr && field->type() == pb::FieldDescriptor::TYPE_MESSAGE) {
          const auto limit = in->PushLimit(static_cast<int>(length));
          const bool good = count_fields(in, field->message_type(), depth + 1, fields) && in->BytesUntilLimit() == 0;
          in->PopLimit(limit);
          if (!good) return false;
        } else if (!in->Skip(static_cast<int>(length))) {
          return false;
        }
        break;
      }
      default:  // groups: ONNX has none
        return false;
    }
  }
  return in->ConsumedEntireMessage();
}

/// A size that a file leaves open fits any.
bool fits(const std::vector<std::int64_t>& shape, const std::vector<std::int64_t>& expected) {
  return std::equal(shape.begin(), shape.end(), expected.begin(), expected.end(),
                    [](std::int64_t a, std::int64_t b) { return a == kOpenSize || a == b; });
}

/// PyTorch 1.13 names every node, others none; what it makes has a name anyway.
std::string node_name(const onnx::NodeProto& node) {
  return in_quotes(node.name().empty() && node.output_size() > 0 ? node.output(0) : node.name());
}

Status check_size(const std::filesystem::path& file, const onnx::GraphProto& graph) {
  if (graph.sparse_initializer_size() > 0) return file_error(file, "has sparse tensors, expected dense ones");
  if (graph.node_size() > kMaxNodes || graph.initializer_size() > kMaxTensors) {
    return file_error(file, "has " + std::to_string(graph.node_size()) + " nodes and " +
                                std::to_string(graph.initializer_size()) + " weights, expected at most " +
                                std::to_string(kMaxNodes) + " and " + std::to_string(kMaxTensors));
  }
  return {};
}

/// Of several outputs all but one go, with what only they need: nodes, weights and inputs.
void keep_only(const std::string& output, onnx::GraphProto* graph) {
  if (graph->output_size() < 2 || std::none_of(graph->output().begin(), graph->output().end(),
                                               [&](const auto& value) { return value.name() == output; }))
    return;
  std::set<std::string> read_before, needed{output};
  for (const auto& node : graph->node()) read_before.insert(node.input().begin(), node.input().end());
  std::vector<bool> kept(static_cast<std::size_t>(graph->node_size()), false);
  for (int i = graph->node_size(); i-- > 0;) {
    const onnx::NodeProto& node = graph->node(i);
    kept[static_cast<std::size_t>(i)] = std::any_of(node.output().begin(), node.output().end(), [&](const auto& name) {
      return !name.empty() && needed.contains(name);
    });
    if (kept[static_cast<std::size_t>(i)]) needed.insert(node.input().begin(), node.input().end());
  }
  const auto unused = [&](const auto& value) {
    return read_before.contains(value.name()) && !needed.contains(value.name());
  };
  auto& nodes = *graph->mutable_node();
  std::size_t i = 0;
  nodes.erase(std::remove_if(nodes.begin(), nodes.end(), [&](const auto&) { return !kept[i++]; }), nodes.end());
  auto& weights = *graph->mutable_initializer();
  weights.erase(std::remove_if(weights.begin(), weights.end(), unused), weights.end());
  auto& inputs = *graph->mutable_input();
  inputs.erase(std::remove_if(inputs.begin(), inputs.end(), unused), inputs.end());
  auto& outputs = *graph->mutable_output();
  outputs.erase(
      std::remove_if(outputs.begin(), outputs.end(), [&](const auto& value) { return value.name() != output; }),
      outputs.end());
}

/// Known operators with plain attributes; data of other files comes in, and casts to half precision become casts to
/// single, in which everything is computed.
Status prepare_graph(const std::filesystem::path& file, const Beside& beside, onnx::GraphProto* graph) {
  std::size_t room = kMaxFileBytes;
  for (onnx::TensorProto& tensor : *graph->mutable_initializer()) {
    const std::string name = "tensor " + in_quotes(tensor.name());
    if (Status status = bring_in(file, name, beside, &room, &tensor); !status) return status;
  }
  for (onnx::NodeProto& node : *graph->mutable_node()) {
    if (!is_standard(node.domain()) || !known_operator(node.op_type())) {
      return file_error(file, "node " + node_name(node) + " is the operator " + in_quotes(node.op_type()) +
                                  (node.domain().empty() ? "" : " of domain " + in_quotes(node.domain())) +
                                  ", expected one of those that docs/bring-your-own-network.md lists");
    }
    for (onnx::AttributeProto& attribute : *node.mutable_attribute()) {
      if (attribute.has_g() || attribute.graphs_size() > 0 || attribute.has_sparse_tensor() ||
          attribute.sparse_tensors_size() > 0 || attribute.tensors_size() > 0) {
        return file_error(file, "node " + node_name(node) + " has the attribute " + in_quotes(attribute.name()) +
                                    " with a graph or sparse tensor in it, expected plain values");
      }
      const std::string name = "the tensor in node " + node_name(node);
      if (!attribute.has_t()) continue;
      if (Status status = bring_in(file, name, beside, &room, attribute.mutable_t()); !status) return status;
    }
    if (node.op_type() != "Cast") continue;
    for (onnx::AttributeProto& attribute : *node.mutable_attribute())
      if (attribute.i() == onnx::TensorProto::FLOAT16 || attribute.i() == onnx::TensorProto::BFLOAT16)
        attribute.set_i(onnx::TensorProto::FLOAT);
  }
  return {};
}

/// The file as it is, of bounded size.
Result<onnx::ModelProto> parse(const std::filesystem::path& file, const std::string& bytes) {
  int fields = 0;
  onnx::ModelProto model;
  if (!safe_to_parse(bytes, onnx::ModelProto::descriptor(), &fields) || !model.ParseFromString(bytes)) {
    return file_error(file, fields > kMaxFields ? "has more than " + std::to_string(kMaxFields) +
                                                      " fields, too many for a network of ours"
                                                : std::string("is cut off or not an ONNX file"));
  }
  return model;
}

}  // namespace

std::string in_quotes(const std::string& name) {
  std::string text = "'";
  for (const char c : name.substr(0, 60)) text += c >= ' ' && c <= '~' ? c : '?';
  return text + (name.size() > 60 ? "...'" : "'");
}

std::string shape_text(const std::vector<std::int64_t>& shape) {
  std::string text = "[";
  for (std::size_t i = 0; i < shape.size(); ++i) {
    text += (i ? ", " : "") + (shape[i] == kOpenSize ? "N" : std::to_string(shape[i]));
  }
  return text + "]";
}

Error file_error(const std::filesystem::path& file, const std::string& what) {
  return Error{what, ErrorCode::kUnreadable}.at(file.string());
}

bool safe_to_parse(const std::string& bytes, const pb::Descriptor* type, int* fields) {
  pb::io::CodedInputStream in(reinterpret_cast<const std::uint8_t*>(bytes.data()), static_cast<int>(bytes.size()));
  return count_fields(&in, type, 0, fields);
}

Result<onnx::ModelProto> parse_onnx(const std::filesystem::path& file, const std::string& bytes,
                                    const std::string& output, const Beside& beside) {
  Result<onnx::ModelProto> parsed = parse(file, bytes);
  if (!parsed) return parsed;
  onnx::ModelProto model = std::move(parsed).value();
  if (!model.has_graph() || model.graph().node_size() == 0)
    return file_error(file, "has no graph: not an ONNX network");
  if (const int version = operator_set(model); version < kOldestOperators || version > kNewestOperators) {
    return file_error(file, (version == 0 ? std::string("names no version of ONNX's operators")
                                          : "is written with operator set " + std::to_string(version)) +
                                ", expected " + std::to_string(kOldestOperators) + " to " +
                                std::to_string(kNewestOperators) + " (opset_version of torch.onnx.export)");
  }
  onnx::GraphProto* const graph = model.mutable_graph();
  if (Status status = check_size(file, *graph); !status) return status.failure();
  keep_only(output, graph);
  if (Status status = inline_functions(file, &model); !status) return status.failure();
  if (Status status = prepare_graph(file, beside, graph); !status) return status.failure();
  return model;
}

Result<std::map<std::string, Array>> parse_tensors(const std::filesystem::path& file, const std::string& bytes) {
  const Result<onnx::ModelProto> model = parse(file, bytes);
  if (!model) return model.failure();
  if (Status status = check_size(file, model->graph()); !status) return status.failure();
  std::map<std::string, Array> tensors;
  for (const onnx::TensorProto& proto : model->graph().initializer()) {
    Result<Array> array = array_of(file, "tensor " + in_quotes(proto.name()), proto);
    if (!array) return array.failure();
    tensors[proto.name()] = std::move(array).value();
  }
  return tensors;
}

int operator_set(const onnx::ModelProto& model) {
  std::int64_t version = 0;
  for (const auto& set : model.opset_import()) {
    if (is_standard(set.domain())) version = set.version();
  }
  return static_cast<int>(std::clamp(version, std::int64_t{0}, std::int64_t{1'000'000}));
}

Status check_ports(const std::filesystem::path& file, const onnx::GraphProto& graph, const std::vector<Port>& inputs,
                   const std::string& output) {
  for (const Port& port : inputs) {
    const auto found = std::find_if(graph.input().begin(), graph.input().end(),
                                    [&](const auto& value) { return value.name() == port.name; });
    if (found == graph.input().end()) {
      return file_error(file,
                        "has no input " + in_quotes(port.name) + ", expected one of shape " + shape_text(port.shape));
    }
    const onnx::TypeProto::Tensor& type = found->type().tensor_type();
    std::vector<std::int64_t> shape;
    for (const auto& dim : type.shape().dim()) shape.push_back(dim.has_dim_value() ? dim.dim_value() : kOpenSize);
    if (type.elem_type() != onnx::TensorProto::FLOAT || !fits(shape, port.shape)) {
      return file_error(file, "input " + in_quotes(port.name) + " has shape " + shape_text(shape) + " of " +
                                  type_text(type.elem_type()) + ", expected " + shape_text(port.shape) + " of " +
                                  type_text(onnx::TensorProto::FLOAT) +
                                  (std::count(port.shape.begin(), port.shape.end(), kOpenSize) > 0
                                       ? ", N left open (dynamic_shapes of torch.onnx.export)"
                                       : "") +
                                  (type.elem_type() != onnx::TensorProto::FLOAT
                                       ? ": call .float() on the inputs, or .half() on them inside forward()"
                                       : ""));
    }
  }
  for (const auto& value : graph.input()) {
    const auto same_name = [&](const auto& other) { return other.name() == value.name(); };
    if (std::none_of(inputs.begin(), inputs.end(), [&](const Port& port) { return port.name == value.name(); }) &&
        std::none_of(graph.initializer().begin(), graph.initializer().end(), same_name)) {
      std::string names;
      for (const Port& port : inputs) names += (names.empty() ? "'" : ", '") + port.name + "'";
      return file_error(file, "has the input " + in_quotes(value.name()) + ", expected only " + names);
    }
  }
  const auto& outputs = graph.output();
  if (std::none_of(outputs.begin(), outputs.end(), [&](const auto& value) { return value.name() == output; })) {
    return file_error(file, "has " + std::to_string(outputs.size()) + " outputs" +
                                (outputs.empty() ? "" : ", the first being " + in_quotes(outputs[0].name())) +
                                ", expected one called " + in_quotes(output) + " (output_names of torch.onnx.export)");
  }
  return {};
}

}  // namespace gatefield::model
