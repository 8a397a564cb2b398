#pragma once

#include <fastcdr/Cdr.h>
#include <fastcdr/FastBuffer.h>

#include <cstdint>
#include <string>

#include "common/dds/wire_type.h"
#include "common/protocol/messages.h"
#include "gatefield_idl/gatefieldPubSubTypes.h"

/// Inside common/dds only.
namespace gatefield::dds {

/// SessionRequest as a server reads it: of a client that speaks another version only what is the same in every version
/// (idl/gatefield.idl) is read, and the rest is as a new request has it. The version then says why it is refused.
class RequestType final : public WireType<wire::SessionRequestPubSubType> {
 public:
  bool deserialize(eprosima::fastrtps::rtps::SerializedPayload_t* payload, void* data) override {
    try {
      eprosima::fastcdr::FastBuffer buffer(reinterpret_cast<char*>(payload->data), payload->length);
      eprosima::fastcdr::Cdr in(buffer, eprosima::fastcdr::Cdr::DEFAULT_ENDIAN, eprosima::fastcdr::Cdr::DDS_CDR);
      in.read_encapsulation();
      std::uint32_t version = 0;
      in >> version;
      if (version == protocol::kVersion) return WireType::deserialize(payload, data);
      auto& request = *static_cast<wire::SessionRequest*>(data);
      request = wire::SessionRequest();
      request.version(version);
      std::string vehicle;
      in >> vehicle >> request.request() >> request.action();
      request.vehicle() = vehicle.c_str();
      return true;
    } catch (...) {
      return false;
    }
  }
};

}  // namespace gatefield::dds
