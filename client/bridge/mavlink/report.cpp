#include "client/bridge/mavlink/report.h"

#include <algorithm>
#include <cmath>

#include "common/base/text.h"

namespace gatefield::bridge {
namespace {

std::string milliseconds(Stamp span) { return fixed(seconds(span) * 1e3, 1) + " ms"; }

std::string firmware_name(std::uint8_t autopilot) {
  switch (static_cast<mavlink::AutopilotKind>(autopilot)) {
    case mavlink::AutopilotKind::kPx4:
      return "PX4";
    case mavlink::AutopilotKind::kArduPilot:
      return "ArduPilot";
    default:
      return "autopilot kind " + text(autopilot);
  }
}

std::string words(const mavlink::StatusText& message) {
  const auto end = std::find(message.text.begin(), message.text.end(), '\0');
  return {message.text.begin(), end};
}

}  // namespace

std::vector<std::string> description(const AutopilotReport& report, const MavlinkConfig& config) {
  if (!report.peer) return {"no autopilot has been heard on " + config.link};
  std::vector<std::string> lines;
  lines.push_back(firmware_name(report.heartbeat.autopilot) + ", system " + text(report.peer->system) + ", component " +
                  text(report.peer->component) + ", on " + config.link);
  if (config.stamps == Stamps::kTimeSync)
    lines.push_back("round trip " + milliseconds(report.round_trip) + ", its clock " +
                    fixed(seconds(report.offset), 3) + " s ahead of ours, drift " + fixed(report.drift_ppm, 1) +
                    " ppm");
  const auto known = rules(config.dialect).parameters;
  for (std::size_t i = 0; i < known.size(); ++i)
    lines.push_back(std::string(known[i].name) + " is " +
                    (std::isnan(report.parameters[i]) ? "not known" : text(report.parameters[i])));
  return lines;
}

std::vector<std::string> complaints(const AutopilotReport& report, const mavlink::ReaderCounts& counts,
                                    const MavlinkConfig& config) {
  const DialectRules& dialect = rules(config.dialect);
  std::vector<std::string> sentences;
  const auto add = [&sentences](std::string sentence) {
    if (!sentence.empty()) sentences.push_back(std::move(sentence));
  };
  if (!report.peer) {
    add("no heartbeat of an autopilot on " + config.link + "; check address, baud rate and that MAVLink is on there");
    if (counts.frames == 0 && counts.noise_bytes > 0)
      add(text(counts.noise_bytes) + " bytes came on " + config.link +
          " and no MAVLink frame was among them; check the baud rate");
    return sentences;
  }
  if (report.silent_for > Autopilot::kSilent)
    add("the autopilot has been silent for " + fixed(seconds(report.silent_for), 1) + " s");
  if (report.wrong_firmware)
    add("the autopilot is " + firmware_name(report.heartbeat.autopilot) + ", expected " +
        std::string(dialect.autopilot_name) + "; set the dialect");
  if (report.parameters_done && !report.thrust_is_thrust)
    add("GUID_OPTIONS is " + text(report.parameters[0]) +
        ", expected bit 3 (8) in it, so that thrust means thrust; set it, or may_set_parameters");
  if (config.stamps == Stamps::kTimeSync)
    add(describe(report.clock, report.round_trip, report.drift_ppm, config.time_sync).error());
  if (report.clock == TimeSync::Trouble::kNone && report.no_state != NoState::kNone)
    add(describe(report.no_state, report.wrong_age, config.state).message);
  const std::string said = report.warning ? "; it says: \"" + words(*report.warning) + "\"" : "";
  if (!dialect.mode_name.empty()) add(complaint("mode " + std::string(dialect.mode_name), report.mode, said));
  add(complaint("arming", report.arming, said));
  if (report.taken_away)
    add("the autopilot has left our setpoints by itself or by its pilot; release it, then ask again");
  if (report.refused_setpoints > 0) add(text(report.refused_setpoints) + " setpoints were out of range and not sent");
  if (report.fault)
    add(text(report.faults) + " messages were refused, the last because " + mavlink::describe(*report.fault).message);
  if (counts.signed_frames > 0)
    add("the autopilot signs its messages; it may ignore ours, which are not signed: turn signing off on this link");
  return sentences;
}

}  // namespace gatefield::bridge
