#pragma once

#include <fastdds/rtps/common/SerializedPayload.h>

#include "common/dds/wire_type.h"

/// Inside common/dds only.
namespace gatefield::px4 {

/// A generated type under the name that PX4 gives it, whatever its variant is called in idl/px4.idl, and for exactly
/// the size that it has: a message of another release's layout is refused instead of misread. (All are of one size;
/// RTPS fills payloads up to whole words.)
/// @tparam Message  whose kTopic names the type: vehicle_status gives VehicleStatus_
template <typename Generated, typename Message>
class WireType final : public dds::WireType<Generated> {
 public:
  WireType() { this->setName(type_name().c_str()); }

  bool deserialize(eprosima::fastrtps::rtps::SerializedPayload_t* payload, void* data) override {
    const auto size = static_cast<std::uint32_t>(kEncapsulation + Generated::type::getMaxCdrSerializedSize());
    if (payload->length < size || payload->length > size + kMostPadding) return false;
    return dds::WireType<Generated>::deserialize(payload, data);
  }

 private:
  static constexpr std::size_t kEncapsulation = 4;
  static constexpr std::uint32_t kMostPadding = 3;

  static std::string type_name() {
    std::string name = "px4_msgs::msg::dds_::";
    bool first_of_word = true;
    for (const char c : Message::kTopic) {
      if (c != '_') name += first_of_word && c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
      first_of_word = c == '_';
    }
    return name + "_";
  }
};

}  // namespace gatefield::px4
