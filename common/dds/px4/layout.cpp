#include "common/dds/px4/layout.h"

#include <algorithm>
#include <array>
#include <cctype>

#include "common/base/text.h"
#include "common/dds/endpoint.h"
#include "common/dds/px4/messages.h"

namespace gatefield::px4 {
namespace {

constexpr std::size_t kLongestNamespace = 63;
constexpr int kMaxVersion = 99;

constexpr std::array kTopics{OffboardControlMode::kTopic,
                             VehicleRatesSetpoint::kTopic,
                             VehicleCommand::kTopic,
                             VehicleCommandAck::kTopic,
                             VehicleOdometry::kTopic,
                             VehicleStatus::kTopic,
                             VehicleLandDetected::kTopic,
                             SensorCombined::kTopic,
                             TimesyncStatus::kTopic,
                             ManualControlSetpoint::kTopic,
                             InputRc::kTopic,
                             BatteryStatus::kTopic};

/// Versions other than 0. Release 1.15 had none.
int version(Release release, std::string_view topic) noexcept {
  if (topic == VehicleStatus::kTopic) {
    if (release == Release::k1_18) return 4;
    return release == Release::k1_15 ? 0 : 1;
  }
  if (topic == BatteryStatus::kTopic) return release >= Release::k1_17 ? 1 : 0;
  if (topic == VehicleCommandAck::kTopic) return release == Release::k1_18 ? 1 : 0;
  return 0;
}

std::string suffix(const BusOptions& options, std::string_view topic) {
  const auto told = options.versions.find(std::string(topic));
  const int number = told == options.versions.end() ? version(options.release, topic) : told->second;
  return number == 0 ? std::string() : "_v" + text(number);
}

std::string folder(const BusOptions& options, std::string_view direction) {
  const std::string within = options.name_space.empty() ? "" : options.name_space + "/";
  return "rt/" + within + "fmu/" + std::string(direction) + "/";
}

std::string all_topics() {
  std::string all;
  for (const std::string_view topic : kTopics) all += (all.empty() ? "" : ", ") + std::string(topic);
  return all;
}

bool is_name(std::string_view text) {
  return std::ranges::all_of(
      text, [](char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '/'; });
}

}  // namespace

const std::map<std::string, Release>& release_names() {
  static const std::map<std::string, Release> names{
      {"1.15", Release::k1_15}, {"1.16", Release::k1_16}, {"1.17", Release::k1_17}, {"1.18", Release::k1_18}};
  return names;
}

std::string_view name(Release release) noexcept {
  constexpr std::array<std::string_view, 4> kNames{"1.15", "1.16", "1.17", "1.18"};
  return kNames[static_cast<std::size_t>(release)];
}

Status validate(const BusOptions& options) {
  if (options.domain > dds::kMaxDomain)
    return Error::invalid("domain", text(options.domain), "0 to " + text(dds::kMaxDomain));
  const std::string& name_space = options.name_space;
  if (name_space.size() > kLongestNamespace || !is_name(name_space) || name_space.starts_with('/') ||
      name_space.ends_with('/'))
    return Error::invalid(
        "namespace", "'" + shown(name_space, kLongestNamespace) + "'",
        "at most " + text(kLongestNamespace) + " letters, digits, _ and / in between, as PX4's client has it");
  for (const auto& [topic, number] : options.versions) {
    if (std::ranges::find(kTopics, topic) == kTopics.end())
      return Error::invalid("versions.topic", "'" + shown(topic, kLongestNamespace) + "'", "one of " + all_topics(),
                            ErrorCode::kUnknownName);
    if (number < 0 || number > kMaxVersion)
      return Error::invalid("versions.version", text(number), "0 to " + text(kMaxVersion));
  }
  return {};
}

std::string topic_to_px4(const BusOptions& options, std::string_view topic) {
  return folder(options, "in") + std::string(topic) + suffix(options, topic);
}

std::string topic_from_px4(const BusOptions& options, std::string_view topic) {
  return folder(options, "out") + std::string(topic) + suffix(options, topic);
}

std::string difference(const BusOptions& options, std::string_view topic, std::string_view on_the_bus) {
  const std::string expected = topic_from_px4(options, topic);
  const std::string_view plain = topic;
  const std::size_t slash = on_the_bus.rfind("/fmu/out/");
  if (on_the_bus == expected || slash == std::string_view::npos || !on_the_bus.starts_with("rt/")) return {};
  std::string_view last = on_the_bus.substr(slash + std::string_view("/fmu/out/").size());
  if (!last.starts_with(plain)) return {};
  last.remove_prefix(plain.size());
  if (!last.empty() && !last.starts_with("_v")) return {};
  const std::string there = "PX4 offers " + shown(on_the_bus, 2 * kLongestNamespace) + ", expected " + expected;
  if (!on_the_bus.starts_with(folder(options, "out"))) return there + "; set the namespace";
  return there + "; set the release that PX4 has (now " + std::string(name(options.release)) + ")";
}

}  // namespace gatefield::px4
