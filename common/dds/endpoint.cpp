#include "common/dds/endpoint.h"

namespace gatefield::dds {

const char* topic_name(Topic topic) noexcept {
  switch (topic) {
    case Topic::kSessionRequest:
      return "gatefield/session/request";
    case Topic::kSessionReply:
      return "gatefield/session/reply";
    case Topic::kVehicleState:
      return "gatefield/vehicle/state";
    case Topic::kDepthFrame:
      return "gatefield/vehicle/depth";
    case Topic::kCommand:
      return "gatefield/vehicle/command";
    case Topic::kTelemetry:
      return "gatefield/telemetry";
  }
  return "gatefield/unknown";
}

std::string in_words(const DroppedPackets& dropped) {
  return "dropped " + std::to_string(dropped.count) +
         (dropped.count == 1 ? " packet that no DDS participant sends: from "
                             : " packets that no DDS participant sends, the last one from ") +
         dropped.sender + ", " + std::string(sentence(dropped.fault)) +
         (dropped.submessage != 0 ? " (submessage " + std::to_string(dropped.submessage) + ")" : "") +
         "; look at who sends there";
}

}  // namespace gatefield::dds
