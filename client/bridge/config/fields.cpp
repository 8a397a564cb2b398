#include "client/bridge/config/fields.h"

#include <google/protobuf/descriptor.h>

#include <cmath>
#include <limits>
#include <vector>

#include "common/base/text.h"

namespace gatefield::bridge {
namespace {

using google::protobuf::FieldDescriptor;

constexpr double kLongest_s = 1e6;

/// One field's value on its way to its place.
class Carrier {
 public:
  Carrier(const google::protobuf::Message& message, const FieldDescriptor& field)
      : message_(message), field_(field), reflection_(*message.GetReflection()) {}

  Status operator()(bool* place) const {
    *place = reflection_.GetBool(message_, &field_);
    return {};
  }
  Status operator()(int* place) const {
    *place = reflection_.GetInt32(message_, &field_);
    return {};
  }
  Status operator()(std::uint8_t* place) const { return without_sign(place, std::numeric_limits<std::uint8_t>::max()); }
  Status operator()(std::uint32_t* place) const { return without_sign(place, std::numeric_limits<int>::max()); }
  Status operator()(double* place) const {
    *place = reflection_.GetDouble(message_, &field_);
    return {};
  }
  Status operator()(Stamp* place) const {
    const double span_s = reflection_.GetDouble(message_, &field_);
    if (!(std::abs(span_s) <= kLongest_s))
      return Error::invalid(field_.name(), text(span_s) + " s", "a time of at most " + text(kLongest_s) + " s");
    *place = from_seconds(span_s);
    return {};
  }
  Status operator()(std::string* place) const {
    *place = reflection_.GetString(message_, &field_);
    return {};
  }

 private:
  template <typename Number>
  Status without_sign(Number* place, int largest) const {
    const int value = reflection_.GetInt32(message_, &field_);
    if (value < 0 || value > largest) return Error::invalid(field_.name(), text(value), "0 to " + text(largest));
    *place = static_cast<Number>(value);
    return {};
  }

  const google::protobuf::Message& message_;
  const FieldDescriptor& field_;
  const google::protobuf::Reflection& reflection_;
};

}  // namespace

Status take_fields(const google::protobuf::Message& message, const std::map<std::string_view, Place>& places) {
  std::vector<const FieldDescriptor*> given;
  message.GetReflection()->ListFields(message, &given);
  for (const FieldDescriptor* field : given) {
    const bool plain =
        field->cpp_type() != FieldDescriptor::CPPTYPE_MESSAGE && field->cpp_type() != FieldDescriptor::CPPTYPE_ENUM;
    if (!plain) continue;
    if (Status status = std::visit(Carrier(message, *field), places.at(field->name())); !status) return status;
  }
  return {};
}

}  // namespace gatefield::bridge
