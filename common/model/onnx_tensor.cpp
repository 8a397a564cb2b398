#include "common/model/onnx_tensor.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <iterator>
#include <limits>

#include "common/model/onnx_file.h"

namespace gatefield::model {
namespace {

template <typename Number>
double plain(const char* bytes) {
  Number value;
  std::memcpy(&value, bytes, sizeof value);
  return static_cast<double>(value);
}

double half(const char* bytes) {
  std::uint16_t bits = 0;
  std::memcpy(&bits, bytes, sizeof bits);
  const int exponent = bits >> 10 & 31, fraction = bits & 1023;
  double value = std::ldexp(fraction, -24);
  if (exponent == 31) value = fraction == 0 ? std::numeric_limits<double>::infinity() : std::nan("");
  if (exponent > 0 && exponent < 31) value = std::ldexp(1024 + fraction, exponent - 25);
  return bits >> 15 != 0 ? -value : value;
}

double brain_half(const char* bytes) {
  const char wide[4] = {0, 0, bytes[0], bytes[1]};  // the upper half of a float
  return plain<float>(wide);
}

struct Kind {
  int type;
  std::size_t bytes;
  bool integer;
  double (*number)(const char* bytes);
};
constexpr Kind kKinds[] = {
    {onnx::TensorProto::FLOAT, 4, false, plain<float>},       {onnx::TensorProto::FLOAT16, 2, false, half},
    {onnx::TensorProto::BFLOAT16, 2, false, brain_half},      {onnx::TensorProto::INT32, 4, true, plain<std::int32_t>},
    {onnx::TensorProto::INT64, 8, true, plain<std::int64_t>}, {onnx::TensorProto::BOOL, 1, true, plain<std::uint8_t>},
};

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

/// Whether `text` is a plain file name: nothing that leads elsewhere.
bool stays_here(const std::string& text) {
  return !text.empty() && text.size() < 256 && text[0] != '.' &&
         std::all_of(text.begin(), text.end(), [](char c) { return c >= ' ' && c <= '~' && c != '/' && c != '\\'; });
}

}  // namespace

std::string type_text(int type) {
  return "ONNX data type " + std::to_string(type) +
         (onnx::TensorProto::DataType_IsValid(type)
              ? " (" + onnx::TensorProto::DataType_Name(static_cast<onnx::TensorProto::DataType>(type)) + ")"
              : "");
}

Status bring_in(const std::filesystem::path& file, const std::string& name, const Beside& beside, std::size_t* room,
                onnx::TensorProto* proto) {
  if (proto->data_location() != onnx::TensorProto::EXTERNAL && proto->external_data_size() == 0) return {};
  std::string location;
  std::size_t offset = 0, length = std::string::npos;
  bool numbers = true;
  for (const auto& entry : proto->external_data()) {
    const std::string& text = entry.value();
    const auto number = [&](std::size_t* to) {
      const auto [end, problem] = std::from_chars(text.data(), text.data() + text.size(), *to);
      numbers = numbers && problem == std::errc() && end == text.data() + text.size();
    };
    if (entry.key() == "location") location = text;
    if (entry.key() == "offset") number(&offset);
    if (entry.key() == "length") number(&length);
  }
  const std::string where = name + " has its data in another file, " + in_quotes(location);
  if (!stays_here(location) || !beside) {
    return file_error(
        file, where + ", expected the plain name of a file beside this one (as torch.onnx.export writes " +
                  in_quotes(file.filename().string() + ".data") + "), or the data in this file (external_data=False)");
  }
  const Result<const std::string*> bytes = beside(location);
  if (!bytes.ok()) return bytes.failure();
  if (*bytes == nullptr)
    return file_error(file, where + ", which is missing: copy it beside this file, or export with external_data=False");
  const std::size_t size = (*bytes)->size();
  if (!numbers || offset > size || (length != std::string::npos && length > size - offset)) {
    return file_error(file, where + ", from byte " + std::to_string(offset) + " on, expected a piece of its " +
                                std::to_string(size) + " bytes: the two files are not of one export");
  }
  length = std::min(length, size - offset);
  if (length > *room) {
    return file_error(file, where + ": its tensors together take more than " + std::to_string(kMaxFileBytes) +
                                " bytes, too many for a network of ours");
  }
  *room -= length;
  proto->set_raw_data((*bytes)->data() + offset, length);
  proto->clear_external_data();
  proto->clear_data_location();
  return {};
}

Result<Array> array_of(const std::filesystem::path& file, const std::string& name, const onnx::TensorProto& proto) {
  if (proto.has_segment()) return file_error(file, name + " comes in segments, expected it whole");
  const std::int64_t elements = elements_of(proto);
  if (elements < 0) return file_error(file, name + " has the impossible shape " + shape_text(shape_of(proto)));
  const auto* const kind =
      std::find_if(std::begin(kKinds), std::end(kKinds), [&](const Kind& k) { return k.type == proto.data_type(); });
  if (kind == std::end(kKinds)) {
    return file_error(file, name + " has " + type_text(proto.data_type()) +
                                ", expected FLOAT, FLOAT16, BFLOAT16, INT32, INT64 or BOOL: call .float() on what is "
                                "exported, and leave out quantisation and text");
  }
  const std::string& raw = proto.raw_data();
  const int listed = proto.float_data_size() + proto.int32_data_size() + proto.int64_data_size();
  const int own = kind->type == onnx::TensorProto::FLOAT   ? proto.float_data_size()
                  : kind->type == onnx::TensorProto::INT64 ? proto.int64_data_size()
                                                           : proto.int32_data_size();
  if (proto.has_raw_data() && listed > 0) return file_error(file, name + " has its data twice");
  if (proto.has_raw_data() && raw.size() != static_cast<std::size_t>(elements) * kind->bytes) {
    return file_error(file, name + " has " + std::to_string(raw.size()) + " bytes of data, expected " +
                                std::to_string(static_cast<std::size_t>(elements) * kind->bytes) + " for shape " +
                                shape_text(shape_of(proto)));
  }
  if (!proto.has_raw_data() && own != elements) {
    return file_error(file, name + " has " + std::to_string(own) + " numbers, expected " + std::to_string(elements) +
                                " for shape " + shape_text(shape_of(proto)));
  }
  Array array{shape_of(proto), std::vector<double>(static_cast<std::size_t>(elements)), kind->integer};
  for (int i = 0; i < elements; ++i) {
    double& value = array.values[static_cast<std::size_t>(i)];
    if (proto.has_raw_data()) {
      value = kind->number(raw.data() + static_cast<std::size_t>(i) * kind->bytes);
    } else if (kind->type == onnx::TensorProto::FLOAT) {
      value = static_cast<double>(proto.float_data(i));
    } else if (kind->type == onnx::TensorProto::INT64) {
      value = static_cast<double>(proto.int64_data(i));
    } else {  // the bits of halves and bools, too
      const std::int32_t bits = proto.int32_data(i);
      value = kind->number(reinterpret_cast<const char*>(&bits));
    }
    if (!std::isfinite(value)) {
      return file_error(file, name + " has the value " + std::to_string(value) + " at element " + std::to_string(i) +
                                  ", expected finite numbers");
    }
  }
  return array;
}

}  // namespace gatefield::model
