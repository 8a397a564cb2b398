#include "common/dds/network_arguments.h"

#include <CLI/CLI.hpp>
#include <utility>

namespace gatefield::dds {
namespace {

/// For the parser: what is wrong, or nothing.
auto sentence_of(Status (*validate)(const std::string&)) {
  return [validate](const std::string& value) { return validate(value).error(); };
}

}  // namespace

void add_network_options(CLI::App* app, NetworkOptions* options, const std::string& group) {
  const auto list = [&](const char* name, std::vector<std::string>* place, const char* help, const char* type) {
    return app->add_option(name, *place, help)->allow_extra_args(false)->type_name(type)->group(group);
  };
  list("--peer", &options->peers,
       "A host to call directly, where multicast does not get; may be given again. Of participants 0 to 9 of that "
       "host, unless told",
       "HOST[:FIRST-LAST]")
      ->check(sentence_of(validate_peer), "");
  list("--interface", &options->interfaces,
       "Network interface to speak and listen on, by name or address; may be given again (default: all)",
       "NAME|ADDRESS");
  list("--discovery-server", &options->discovery_servers,
       "Where a discovery server listens, through which alone others are found; may be given again", "HOST:PORT")
      ->check(sentence_of(validate_discovery_server), "");
  app->add_flag("--shared-memory", options->shared_memory,
                "Shared memory beside UDP, for programs of this host that are told so, too")
      ->group(group);
  app->add_option("--security", options->security,
                  "Folder that gatefield-keys made for this name: encrypted, and closed to all who have none")
      ->type_name("FOLDER")
      ->group(group);
}

std::vector<std::string> network_arguments(const NetworkOptions& options) {
  std::vector<std::string> words;
  for (const auto& [name, list] : {std::pair("--peer", &options.peers),
                                   {"--interface", &options.interfaces},
                                   {"--discovery-server", &options.discovery_servers}})
    for (const std::string& value : *list) words.insert(words.end(), {name, value});
  if (options.shared_memory) words.emplace_back("--shared-memory");
  return words;
}

}  // namespace gatefield::dds
