#include "common/dds/endpoint.h"

#include "common/base/text.h"

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
    case Topic::kServerStatus:
      return "gatefield/server/status";
    case Topic::kPilotRecord:
      return "gatefield/server/pilot";
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

std::string in_words(const DroppedSamples& dropped) {
  return "dropped " + std::to_string(dropped.count) + (dropped.count == 1 ? " sample" : " samples") +
         (dropped.count == 1 ? ": of " : ", the last one of ") + topic_name(dropped.topic) +
         (dropped.vehicle.empty() ? "" : " for \"" + shown(dropped.vehicle, 63) + "\"") + " from participant " +
         in_words(dropped.from) + ": " + std::string(sentence(dropped.fault));
}

std::string in_words(const ParticipantId& participant) {
  std::string words;
  for (const std::uint8_t byte : participant.bytes) {
    constexpr const char* kDigits = "0123456789abcdef";
    words += words.empty() ? "" : ".";
    words += {kDigits[byte / 16], kDigits[byte % 16]};
  }
  return words;
}

std::string_view sentence(SampleFault fault) noexcept {
  switch (fault) {
    case SampleFault::kNone:
      return "nothing";
    case SampleFault::kElsewhere:
      return "another server has its session";
    case SampleFault::kStranger:
      return "another participant has that session or number, or nobody";
    case SampleFault::kTooManyNames:
      return "it asks for more vehicles than one participant may, or all together";
    case SampleFault::kNotItsName:
      return "its certificate is another vehicle's";
    case SampleFault::kTooOften:
      return "it sends more than one participant may";
  }
  return "";
}

}  // namespace gatefield::dds
