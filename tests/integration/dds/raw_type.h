#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <vector>

#include "common/dds/wire_type.h"

namespace gatefield::dds {

/// Writes any bytes as a sample of a type: the encapsulation and what follows.
template <typename Generated>
class RawType : public WireType<Generated> {
 public:
  static inline std::vector<std::uint8_t> bytes;
  bool serialize(void*, eprosima::fastrtps::rtps::SerializedPayload_t* payload) override {
    if (bytes.size() > payload->max_size) return false;
    std::copy(bytes.begin(), bytes.end(), payload->data);
    payload->length = static_cast<std::uint32_t>(bytes.size());
    payload->encapsulation = CDR_LE;
    return true;
  }
  std::function<std::uint32_t()> getSerializedSizeProvider(void*) override {
    return [] { return static_cast<std::uint32_t>(bytes.size()); };
  }
};

}  // namespace gatefield::dds
