#include "common/dds/environment.h"

#include <cstdlib>
#include <filesystem>
#include <optional>
#include <system_error>
#include <utility>

#include "common/base/text.h"
#include "common/base/whole_file.h"

namespace gatefield::dds {
namespace {

constexpr const char* kProfilesHere = "DEFAULT_FASTRTPS_PROFILES.xml";
constexpr const char* kSkipProfilesHere = "SKIP_DEFAULT_XML_FILE";
constexpr std::size_t kShown = 200;

std::optional<std::string> variable(const char* name) {
  const char* const value = std::getenv(name);
  return value == nullptr || *value == '\0' ? std::nullopt : std::optional<std::string>(value);
}

/// Whether it holds a property of DDS security. What can't be read asks for nothing.
bool asks_for_security(const std::string& file) {
  constexpr std::uintmax_t kMost = 64 << 20;  // no profile is as large
  const auto text = read_file(file, kMost);
  return text.ok() && text->find("dds.sec.") != std::string::npos;
}

std::string named(const char* name, const std::string& value) {
  return std::string(name) + " is set (" + shown(value, kShown) + ") and ";
}

}  // namespace

std::vector<std::string> settle_environment(const NetworkOptions& options) {
  std::vector<std::string> sentences;
  const std::string instead = "QoS and transports are the program's own; see --peer, --interface, --discovery-server";
  for (const auto& [name, what] :
       {std::pair("FASTRTPS_DEFAULT_PROFILES_FILE", "not read: " + instead),
        std::pair("FASTDDS_DEFAULT_PROFILES_FILE", "not read: " + instead),
        std::pair("FASTDDS_ENVIRONMENT_FILE", std::string("not read: use --discovery-server")),
        std::pair("FASTDDS_STATISTICS",
                  std::string("not heeded: nothing is published but the topics of docs/wire.md"))})
    if (const auto value = variable(name)) {
      sentences.push_back(named(name, *value) + what);
      if (!asks_for_security(*value)) unsetenv(name);
    }
  std::error_code failed;
  if (std::filesystem::exists(kProfilesHere, failed)) {
    sentences.push_back(std::string(kProfilesHere) + " lies in the working directory and is not read: " + instead);
    if (!asks_for_security(kProfilesHere)) setenv(kSkipProfilesHere, "1", 1);
  }
  if (const auto servers = variable("ROS_DISCOVERY_SERVER"))
    sentences.push_back(named("ROS_DISCOVERY_SERVER", *servers) +
                        (options.discovery_servers.empty() ? "taken as --discovery-server"
                                                           : "not heeded, since --discovery-server is given"));
  return sentences;
}

Status check_environment(const NetworkOptions& options) {
  if (!options.security.empty()) return {};
  const auto refuse = [](const std::string& value) {
    return Error::invalid("security", value,
                          "the folder that gatefield-keys made for who takes part here: XML profiles are not read, and "
                          "this one asks for DDS security (dds.sec.). Or else without that file");
  };
  for (const char* name : {"FASTRTPS_DEFAULT_PROFILES_FILE", "FASTDDS_DEFAULT_PROFILES_FILE"})
    if (const auto file = variable(name); file && asks_for_security(*file))
      return refuse("empty, and " + std::string(name) + " is " + shown(*file, kShown));
  if (!variable(kSkipProfilesHere) && asks_for_security(kProfilesHere))
    return refuse("empty, and " + std::string(kProfilesHere) + " lies in the working directory");
  return {};
}

}  // namespace gatefield::dds
