#include "common/model/onnx_file.h"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/wire_format_lite.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <set>
#include <utility>

#include "common/model/onnx_graph.h"

namespace gatefield::model {
namespace {

namespace pb = google::protobuf;

/// Fields in a whole file. Parsed elements take far more memory than their bytes, so that a small file of empty ones
/// could take gigabytes; networks of ours have some thousands.
constexpr int kMaxFields = 200'000;
constexpr int kMaxDepth = 32;
constexpr int kMaxNodes = 2000;
constexpr int kMaxTensors = 2000;
/// What torch.onnx.export writes for opset_version 11 to 17, and OpenCV reads.
constexpr int kOldestOperators = 11;
constexpr int kNewestOperators = 17;

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

bool fits(const std::vector<std::int64_t>& shape, const std::vector<std::int64_t>& expected) {
  return std::equal(shape.begin(), shape.end(), expected.begin(), expected.end(),
                    [](std::int64_t a, std::int64_t b) { return b == kAnySize || a == b; });
}

std::string type_text(int type) {
  return "ONNX data type " + std::to_string(type) +
         (onnx::TensorProto::DataType_IsValid(type)
              ? " (" + onnx::TensorProto::DataType_Name(static_cast<onnx::TensorProto::DataType>(type)) + ")"
              : "");
}

std::vector<std::int64_t> shape_of(const onnx::TensorProto& proto) {
  return {proto.dims().begin(), proto.dims().end()};
}

/// Number of elements that the shape says; -1 when it can't be.
std::int64_t elements_of(const onnx::TensorProto& proto) {
  std::int64_t count = 1;
  bool empty = false;
  if (proto.dims_size() > 8) return -1;
  for (const std::int64_t size : proto.dims()) {
    if (size < 0 || size > static_cast<std::int64_t>(kMaxFileBytes)) return -1;
    empty = empty || size == 0;
    count *= std::max(size, std::int64_t{1});  // strides are products of the others even if one is 0
    if (count > static_cast<std::int64_t>(kMaxFileBytes)) return -1;
  }
  return empty ? 0 : count;
}

/// Data complete, in this file, of a type that our networks have, and finite.
Status check_tensor(const std::filesystem::path& file, const std::string& name, const onnx::TensorProto& proto) {
  if (proto.data_location() == onnx::TensorProto::EXTERNAL || proto.external_data_size() > 0) {
    return file_error(file, name + " has its data in another file, expected it in this one");
  }
  if (proto.has_segment()) return file_error(file, name + " comes in segments, expected it whole");
  const std::int64_t elements = elements_of(proto);
  if (elements < 0) return file_error(file, name + " has the impossible shape " + shape_text(shape_of(proto)));
  std::size_t element_bytes = 0;
  std::int64_t listed = 0;
  switch (proto.data_type()) {
    case onnx::TensorProto::FLOAT:
      element_bytes = 4;
      listed = proto.float_data_size();
      break;
    case onnx::TensorProto::INT32:
      element_bytes = 4;
      listed = proto.int32_data_size();
      break;
    case onnx::TensorProto::INT64:
      element_bytes = 8;
      listed = proto.int64_data_size();
      break;
    default:
      return file_error(file,
                        name + " has " + type_text(proto.data_type()) + ", expected 1 (FLOAT), 6 (INT32) or 7 (INT64)");
  }
  if (proto.has_raw_data()) {
    if (listed != 0) return file_error(file, name + " has its data twice");
    if (proto.raw_data().size() != static_cast<std::size_t>(elements) * element_bytes) {
      return file_error(file, name + " has " + std::to_string(proto.raw_data().size()) + " bytes of data, expected " +
                                  std::to_string(static_cast<std::size_t>(elements) * element_bytes) + " for shape " +
                                  shape_text(shape_of(proto)));
    }
  } else if (listed != elements) {
    return file_error(file, name + " has " + std::to_string(listed) + " numbers, expected " + std::to_string(elements) +
                                " for shape " + shape_text(shape_of(proto)));
  }
  if (proto.data_type() != onnx::TensorProto::FLOAT) return {};
  for (std::int64_t i = 0; i < elements; ++i) {
    float value = 0.0f;
    if (proto.has_raw_data()) {
      std::memcpy(&value, proto.raw_data().data() + static_cast<std::size_t>(i) * sizeof value, sizeof value);
    } else {
      value = proto.float_data(static_cast<int>(i));
    }
    if (!std::isfinite(value)) {
      return file_error(file, name + " has the value " + std::to_string(value) + " at element " + std::to_string(i) +
                                  ", expected finite numbers");
    }
  }
  return {};
}

/// PyTorch 1.13 names every node, others none; what it makes has a name anyway.
std::string node_name(const onnx::NodeProto& node) {
  return in_quotes(node.name().empty() && node.output_size() > 0 ? node.output(0) : node.name());
}

Status check_graph(const std::filesystem::path& file, const onnx::GraphProto& graph) {
  if (graph.sparse_initializer_size() > 0) return file_error(file, "has sparse tensors, expected dense ones");
  if (graph.node_size() > kMaxNodes || graph.initializer_size() > kMaxTensors) {
    return file_error(file, "has " + std::to_string(graph.node_size()) + " nodes and " +
                                std::to_string(graph.initializer_size()) + " weights, expected at most " +
                                std::to_string(kMaxNodes) + " and " + std::to_string(kMaxTensors));
  }
  std::set<std::string> names;
  for (const onnx::TensorProto& proto : graph.initializer()) {
    if (!names.insert(proto.name()).second)
      return file_error(file, "tensor " + in_quotes(proto.name()) + " is there twice");
    if (Status status = check_tensor(file, "tensor " + in_quotes(proto.name()), proto); !status.ok()) return status;
  }
  for (const onnx::NodeProto& node : graph.node()) {
    if ((!node.domain().empty() && node.domain() != "ai.onnx") || !known_operator(node.op_type())) {
      return file_error(file, "node " + node_name(node) + " is the operator " + in_quotes(node.op_type()) +
                                  (node.domain().empty() ? "" : " of domain " + in_quotes(node.domain())) +
                                  ", expected one of those that docs/bring-your-own-network.md lists");
    }
    for (const onnx::AttributeProto& attribute : node.attribute()) {
      if (attribute.has_g() || attribute.graphs_size() > 0 || attribute.has_sparse_tensor() ||
          attribute.sparse_tensors_size() > 0 || attribute.tensors_size() > 0) {
        return file_error(file, "node " + node_name(node) + " has the attribute " + in_quotes(attribute.name()) +
                                    " with a graph or sparse tensor in it, expected plain values");
      }
      if (attribute.has_t()) {
        const std::string name = "the tensor in node " + node_name(node);
        if (Status status = check_tensor(file, name, attribute.t()); !status.ok()) return status;
      }
    }
  }
  return {};
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
    text += (i ? ", " : "") + (shape[i] == kAnySize    ? std::string("any")
                               : shape[i] == kOpenSize ? std::string("N")
                                                       : std::to_string(shape[i]));
  }
  return text + "]";
}

Error file_error(const std::filesystem::path& file, const std::string& what) {
  return Error{what, ErrorCode::kUnreadable}.at(file.string());
}

Result<onnx::ModelProto> parse_onnx(const std::filesystem::path& file, const std::string& bytes) {
  const auto* data = reinterpret_cast<const std::uint8_t*>(bytes.data());
  const int size = static_cast<int>(bytes.size());
  pb::io::CodedInputStream in(data, size);
  int fields = 0;
  onnx::ModelProto model;
  if (!count_fields(&in, onnx::ModelProto::descriptor(), 0, &fields)) {
    return file_error(file, fields > kMaxFields ? "has more than " + std::to_string(kMaxFields) +
                                                      " fields, too many for a network of ours"
                                                : std::string("is cut off or not an ONNX file"));
  }
  if (!model.ParseFromArray(data, size)) return file_error(file, "is cut off or not an ONNX file");
  if (!model.has_graph() || model.graph().node_size() == 0)
    return file_error(file, "has no graph: not an ONNX network");
  if (model.functions_size() > 0) return file_error(file, "defines functions of its own, expected none");
  if (const int version = operator_set(model); version < kOldestOperators || version > kNewestOperators) {
    return file_error(file, (version == 0 ? std::string("names no version of ONNX's operators")
                                          : "is written with operator set " + std::to_string(version)) +
                                ", expected " + std::to_string(kOldestOperators) + " to " +
                                std::to_string(kNewestOperators) + " (opset_version of torch.onnx.export)");
  }
  if (Status status = check_graph(file, model.graph()); !status.ok()) return status.failure();
  return model;
}

int operator_set(const onnx::ModelProto& model) {
  std::int64_t version = 0;
  for (const auto& set : model.opset_import()) {
    if (set.domain().empty() || set.domain() == "ai.onnx") version = set.version();
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
                                       ? ", N left open (dynamic_axes of torch.onnx.export)"
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
  if (graph.output_size() != 1 || graph.output(0).name() != output) {
    return file_error(file,
                      "has " + std::to_string(graph.output_size()) + " outputs" +
                          (graph.output_size() > 0 ? ", the first being " + in_quotes(graph.output(0).name()) : "") +
                          ", expected only " + in_quotes(output));
  }
  return {};
}

}  // namespace gatefield::model
