#include "common/model/onnx_file.h"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/wire_format_lite.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <fstream>
#include <set>
#include <string_view>

namespace gatefield::model {
namespace {

namespace pb = google::protobuf;

/// Fields in a whole file. Parsed elements take far more memory than their bytes, so that a small file of empty ones
/// could take gigabytes; networks of ours have some thousands.
constexpr int kMaxFields = 200'000;
constexpr int kMaxDepth = 32;

/// What our networks are made of. None runs code, opens files or loops.
constexpr std::array kOperators = std::to_array<std::string_view>({"Abs",
                                                                   "Add",
                                                                   "AveragePool",
                                                                   "BatchNormalization",
                                                                   "Cast",
                                                                   "Ceil",
                                                                   "Clip",
                                                                   "Concat",
                                                                   "Constant",
                                                                   "Conv",
                                                                   "Cos",
                                                                   "Div",
                                                                   "Exp",
                                                                   "Expand",
                                                                   "Flatten",
                                                                   "Floor",
                                                                   "Gather",
                                                                   "Gemm",
                                                                   "GlobalAveragePool",
                                                                   "GlobalMaxPool",
                                                                   "Identity",
                                                                   "LeakyRelu",
                                                                   "Log",
                                                                   "MatMul",
                                                                   "Max",
                                                                   "MaxPool",
                                                                   "Min",
                                                                   "Mul",
                                                                   "Neg",
                                                                   "Pad",
                                                                   "Pow",
                                                                   "ReduceMax",
                                                                   "ReduceMean",
                                                                   "ReduceSum",
                                                                   "Relu",
                                                                   "Reshape",
                                                                   "Resize",
                                                                   "Shape",
                                                                   "Sigmoid",
                                                                   "Sin",
                                                                   "Slice",
                                                                   "Softmax",
                                                                   "Split",
                                                                   "Sqrt",
                                                                   "Squeeze",
                                                                   "Sub",
                                                                   "Tanh",
                                                                   "Tile",
                                                                   "Transpose",
                                                                   "Unsqueeze",
                                                                   "Upsample"});

bool known_operator(const std::string& name) {
  return std::find(kOperators.begin(), kOperators.end(), name) != kOperators.end();
}

/// Names come from the file: no control characters and no novels in our messages.
std::string quoted(const std::string& name) {
  std::string text = "'";
  for (const char c : name.substr(0, 60)) text += c >= ' ' && c <= '~' ? c : '?';
  return text + (name.size() > 60 ? "...'" : "'");
}

Error wrong(const std::filesystem::path& file, const std::string& what) { return Error{file.string() + ": " + what}; }

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

std::string shape_text(const std::vector<std::int64_t>& shape) {
  std::string text = "[";
  for (std::size_t i = 0; i < shape.size(); ++i) {
    text += (i ? ", " : "") + (shape[i] == kAnySize ? std::string("any") : std::to_string(shape[i]));
  }
  return text + "]";
}

bool fits(const std::vector<std::int64_t>& shape, const std::vector<std::int64_t>& expected) {
  if (shape.size() != expected.size()) return false;
  for (std::size_t i = 0; i < shape.size(); ++i) {
    if (expected[i] != kAnySize && shape[i] != expected[i]) return false;
  }
  return true;
}

std::vector<std::int64_t> shape_of(const onnx::TensorProto& proto) {
  return {proto.dims().begin(), proto.dims().end()};
}

/// Number of elements that the shape says; -1 when it can't be.
std::int64_t elements_of(const onnx::TensorProto& proto) {
  std::int64_t count = 1;
  if (proto.dims_size() > 8) return -1;
  for (const std::int64_t size : proto.dims()) {
    if (size < 0 || size > static_cast<std::int64_t>(kMaxFileBytes)) return -1;
    count *= size;
    if (count > static_cast<std::int64_t>(kMaxFileBytes)) return -1;
  }
  return count;
}

/// Data complete, in this file, of a type that our networks have, and finite.
Status check_tensor(const std::filesystem::path& file, const onnx::TensorProto& proto) {
  const std::string name = "tensor " + quoted(proto.name());
  if (proto.data_location() == onnx::TensorProto::EXTERNAL || proto.external_data_size() > 0) {
    return wrong(file, name + " has its data in another file, expected it in this one");
  }
  if (proto.has_segment()) return wrong(file, name + " comes in segments, expected it whole");
  const std::int64_t elements = elements_of(proto);
  if (elements < 0) return wrong(file, name + " has the impossible shape " + shape_text(shape_of(proto)));
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
      return wrong(file, name + " has ONNX data type " + std::to_string(proto.data_type()) +
                             ", expected 1 (float), 6 (int32) or 7 (int64)");
  }
  if (proto.has_raw_data()) {
    if (listed != 0) return wrong(file, name + " has its data twice");
    if (proto.raw_data().size() != static_cast<std::size_t>(elements) * element_bytes) {
      return wrong(file, name + " has " + std::to_string(proto.raw_data().size()) + " bytes of data, expected " +
                             std::to_string(static_cast<std::size_t>(elements) * element_bytes) + " for shape " +
                             shape_text(shape_of(proto)));
    }
  } else if (listed != elements) {
    return wrong(file, name + " has " + std::to_string(listed) + " numbers, expected " + std::to_string(elements) +
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
      return wrong(file, name + " has the value " + std::to_string(value) + " at element " + std::to_string(i) +
                             ", expected finite numbers");
    }
  }
  return {};
}

Status check_graph(const std::filesystem::path& file, const onnx::GraphProto& graph) {
  if (graph.sparse_initializer_size() > 0) return wrong(file, "has sparse tensors, expected dense ones");
  std::set<std::string> names;
  for (const onnx::TensorProto& proto : graph.initializer()) {
    if (!names.insert(proto.name()).second) return wrong(file, "tensor " + quoted(proto.name()) + " is there twice");
    if (Status status = check_tensor(file, proto); !status.ok()) return status;
  }
  for (const onnx::NodeProto& node : graph.node()) {
    if ((!node.domain().empty() && node.domain() != "ai.onnx") || !known_operator(node.op_type())) {
      return wrong(file, "node " + quoted(node.name()) + " is the operator " + quoted(node.op_type()) +
                             (node.domain().empty() ? "" : " of domain " + quoted(node.domain())) +
                             ", expected one of those that Gatefield's networks are made of (docs/training.md)");
    }
    for (const onnx::AttributeProto& attribute : node.attribute()) {
      if (attribute.has_g() || attribute.graphs_size() > 0 || attribute.has_sparse_tensor() ||
          attribute.sparse_tensors_size() > 0) {
        return wrong(file, "node " + quoted(node.name()) + " has the attribute " + quoted(attribute.name()) +
                               " with a graph or sparse tensor in it, expected plain values");
      }
      if (attribute.has_t()) {
        if (Status status = check_tensor(file, attribute.t()); !status.ok()) return status;
      }
      for (const onnx::TensorProto& proto : attribute.tensors()) {
        if (Status status = check_tensor(file, proto); !status.ok()) return status;
      }
    }
  }
  return {};
}

Status check_value(const std::filesystem::path& file, const pb::RepeatedPtrField<onnx::ValueInfoProto>& values,
                   const std::string& kind, const std::string& name, const std::vector<std::int64_t>& expected) {
  const auto found =
      std::find_if(values.begin(), values.end(), [&](const auto& value) { return value.name() == name; });
  if (found == values.end()) {
    return wrong(file, "has no " + kind + " " + quoted(name) + ", expected one of shape " + shape_text(expected));
  }
  const onnx::TypeProto::Tensor& type = found->type().tensor_type();
  std::vector<std::int64_t> shape;
  for (const auto& dim : type.shape().dim()) shape.push_back(dim.has_dim_value() ? dim.dim_value() : kAnySize);
  if (type.elem_type() != onnx::TensorProto::FLOAT || !fits(shape, expected)) {
    return wrong(file, kind + " " + quoted(name) + " has shape " + shape_text(shape) + " of ONNX data type " +
                           std::to_string(type.elem_type()) + ", expected " + shape_text(expected) + " of 1 (float)");
  }
  return {};
}

}  // namespace

Result<std::string> read_file(const std::filesystem::path& file) {
  std::error_code code;
  if (!std::filesystem::is_regular_file(file, code)) {
    return wrong(file, code && code != std::errc::no_such_file_or_directory ? "can't be looked at: " + code.message()
                                                                            : std::string("is missing or not a file"));
  }
  const std::uintmax_t size = std::filesystem::file_size(file, code);
  if (code) return wrong(file, "can't be read: " + code.message());
  if (size > kMaxFileBytes) {
    return wrong(file, "has " + std::to_string(size) + " bytes, expected at most " + std::to_string(kMaxFileBytes));
  }
  std::string bytes(size, '\0');
  std::ifstream in(file, std::ios::binary);
  if (!in.read(bytes.data(), static_cast<std::streamsize>(size))) return wrong(file, "can't be read");
  return bytes;
}

Result<onnx::ModelProto> parse_onnx(const std::filesystem::path& file, const std::string& bytes) {
  const auto* data = reinterpret_cast<const std::uint8_t*>(bytes.data());
  const int size = static_cast<int>(bytes.size());
  pb::io::CodedInputStream in(data, size);
  int fields = 0;
  onnx::ModelProto model;
  if (!count_fields(&in, onnx::ModelProto::descriptor(), 0, &fields)) {
    return wrong(file, fields > kMaxFields
                           ? "has more than " + std::to_string(kMaxFields) + " fields, too many for a network of ours"
                           : std::string("is cut off or not an ONNX file"));
  }
  if (!model.ParseFromArray(data, size)) return wrong(file, "is cut off or not an ONNX file");
  if (!model.has_graph() || model.graph().node_size() == 0) return wrong(file, "has no graph: not an ONNX network");
  if (model.functions_size() > 0) return wrong(file, "defines functions of its own, expected none");
  if (Status status = check_graph(file, model.graph()); !status.ok()) return Error{status.error()};
  return model;
}

const onnx::TensorProto* find_tensor(const onnx::GraphProto& graph, const std::string& name) {
  for (const onnx::TensorProto& proto : graph.initializer()) {
    if (proto.name() == name) return &proto;
  }
  return nullptr;
}

Result<std::vector<float>> tensor(const std::filesystem::path& file, const onnx::GraphProto& graph,
                                  const std::string& name, const std::vector<std::int64_t>& shape) {
  const onnx::TensorProto* proto = find_tensor(graph, name);
  if (proto == nullptr)
    return wrong(file, "tensor " + quoted(name) + " is missing, expected shape " + shape_text(shape));
  if (proto->data_type() != onnx::TensorProto::FLOAT) {
    return wrong(file, "tensor " + quoted(name) + " has ONNX data type " + std::to_string(proto->data_type()) +
                           ", expected 1 (float)");
  }
  if (!fits(shape_of(*proto), shape)) {
    return wrong(file, "tensor " + quoted(name) + " has shape " + shape_text(shape_of(*proto)) + ", expected " +
                           shape_text(shape));
  }
  std::vector<float> values(static_cast<std::size_t>(elements_of(*proto)));
  if (proto->has_raw_data()) {
    std::memcpy(values.data(), proto->raw_data().data(), proto->raw_data().size());
  } else {
    std::copy(proto->float_data().begin(), proto->float_data().end(), values.begin());
  }
  return values;
}

Status check_input(const std::filesystem::path& file, const onnx::GraphProto& graph, const std::string& name,
                   const std::vector<std::int64_t>& shape) {
  return check_value(file, graph.input(), "input", name, shape);
}

Status check_output(const std::filesystem::path& file, const onnx::GraphProto& graph, const std::string& name,
                    const std::vector<std::int64_t>& shape) {
  return check_value(file, graph.output(), "output", name, shape);
}

}  // namespace gatefield::model
