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

}  // namespace gatefield::dds
