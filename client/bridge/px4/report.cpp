#include "client/bridge/px4/report.h"

#include <algorithm>
#include <string_view>

#include "common/base/text.h"

namespace gatefield::bridge {
namespace {

std::string milliseconds(Stamp span) { return fixed(seconds(span) * 1e3, 1) + " ms"; }

std::string where(const Px4Config& config) {
  const std::string in = config.bus.name_space.empty() ? "" : ", namespace " + config.bus.name_space;
  return "domain " + text(config.bus.domain) + in;
}

/// Why there is no status: nothing is offered there, something else is, or it does not come through.
std::string missing_status(const Px4Report& report, const BusReport& bus, const Px4Config& config) {
  const std::string topic = px4::topic_from_px4(config.bus, px4::VehicleStatus::kTopic);
  if (report.stranger)
    return "vehicle " + text(report.stranger_system) + " speaks on " + topic + ", expected vehicle " +
           text(config.vehicle_system) + " (vehicle_system)";
  if (std::ranges::find(bus.offered, topic) != bus.offered.end())
    return topic + " is offered and nothing comes through it" +
           (bus.why ? std::string() : "; look at PX4's agent, or start PX4 again");
  for (const std::string& other : bus.offered)
    if (std::string what = px4::difference(config.bus, px4::VehicleStatus::kTopic, other); !what.empty()) return what;
  if (!bus.offered.empty())
    return "PX4 is there in " + where(config) + " and does not offer " + topic + "; look at its dds_topics.yaml";
  return "nothing of PX4 is heard in " + where(config) +
         "; check that its agent runs, and PX4's UXRCE_DDS_DOM_ID, UXRCE_DDS_CFG and namespace";
}

std::string state_trouble(const Px4Report& report, const Px4Config& config) {
  switch (report.no_state) {
    case NoState::kNone:
      return {};
    case NoState::kNotPaired:
      return "no state has come on " + px4::topic_from_px4(config.bus, px4::VehicleOdometry::kTopic) +
             "; PX4's estimator has none yet: look at its position source (GPS, flow, motion capture)";
    case NoState::kQuality:
      return "PX4 says that its estimate has failed (vehicle_odometry.quality is below 0)";
    case NoState::kFuture:
    case NoState::kOld:
      return "state.age is " + milliseconds(report.wrong_age) + ", expected " + milliseconds(-Odometer::kFuture) +
             " to " + milliseconds(config.state.oldest) + "; the clocks do not agree, or the agent holds messages back";
    default:
      return "states do not rise in time";
  }
}

}  // namespace

std::vector<std::string> description(const Px4Report& report, const Px4Config& config) {
  if (!report.status) return {"no PX4 has been heard in " + where(config)};
  std::vector<std::string> lines;
  lines.push_back("PX4, system " + text(report.status->system_id) + ", in " + where(config) + ", release " +
                  std::string(px4::name(config.bus.release)));
  if (config.stamps == Stamps::kTimeSync)
    lines.push_back("its states are " + milliseconds(report.least_age) +
                    " old at least; it knows its agent's clock to " +
                    milliseconds(std::max(report.own_error, -report.own_error)) + ", round trip " +
                    milliseconds(report.round_trip));
  return lines;
}

std::vector<std::string> complaints(const Px4Report& report, const BusReport& bus, const Px4Config& config) {
  std::vector<std::string> sentences;
  const auto add = [&sentences](const std::string& sentence) {
    if (!sentence.empty()) sentences.push_back(sentence);
  };
  if (!report.status) {
    add(missing_status(report, bus, config));
    if (bus.why) add(bus.why->message);
    return sentences;
  }
  const Stamp silent = std::max(report.silent_for, report.status_age - Px4Autopilot::kStatusLost);
  if (silent > Stamp{std::chrono::seconds(1)})
    add("PX4 has been silent for " + fixed(seconds(silent), 1) +
        " s; when its agent was started again PX4 does not always come back by itself: start PX4 (or its "
        "uxrce_dds_client) "
        "again");
  if (report.stranger)
    add("vehicles " + text(report.status->system_id) + " and " + text(report.stranger_system) +
        " speak on the same topics, so nothing is armed; give each PX4 a namespace of its own");
  add(describe(report.clock, report.least_age, report.own_error, config.clock).error());
  if (report.clock == StampCheck::Trouble::kNone) add(state_trouble(report, config));
  const std::string said = report.status->pre_flight_checks_pass ? "" : "; its own checks before arming do not pass";
  add(complaint("mode OFFBOARD", report.mode, said));
  add(complaint("arming", report.arming, said));
  if (report.taken_away) add("PX4 has left our setpoints by itself or by its pilot; release it, then ask again");
  if (report.refused_setpoints > 0) add(text(report.refused_setpoints) + " setpoints were out of range and not sent");
  if (bus.rejected > 0) add(text(bus.rejected) + " messages were refused, the last: " + bus.why->message);
  if (bus.not_sent > 0) add(text(bus.not_sent) + " messages were not taken by the middleware; look at the network");
  return sentences;
}

}  // namespace gatefield::bridge
