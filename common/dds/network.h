#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "common/base/result.h"

namespace gatefield::dds {

/// Which ways into a DDS domain a program takes, where multicast on every interface is not right. What is left empty is
/// as it always was. IPv4 only. docs/operations.md says when to use what.
struct NetworkOptions {
  /// Hosts that are called one by one, beside multicast: "10.0.0.7", "pit.example", or "10.0.0.7:0-24" for others than
  /// the first ten participants of that host, 0 to 9. One side needs to know the other.
  std::vector<std::string> peers;
  /// Network interfaces to speak and listen on, by name or address: "eth0", "10.0.0.5". Empty: all.
  std::vector<std::string> interfaces;
  /// Where discovery servers listen, "10.0.0.7:11811", the first one with id 0, and so on. Others of the domain are
  /// found through them alone: no multicast, no peers.
  std::vector<std::string> discovery_servers;
  /// Shared memory beside UDP, for processes of one host, one user and one /dev/shm (decision 0046).
  bool shared_memory = false;
  /// Folder that gatefield-keys made for who takes part here: the domain is closed to everybody who has none
  /// (docs/security.md). Empty: it is open. Doesn't go with discovery servers.
  std::string security;
};

inline constexpr std::size_t kMaxPeers = 64;
inline constexpr std::size_t kMaxInterfaces = 16;
inline constexpr std::size_t kMaxDiscoveryServers = 8;

/// One entry each: a sentence without the field's name before it, for what is wrong with it in itself.
Status validate_peer(const std::string& peer);
Status validate_discovery_server(const std::string& server);

/// Checks all that can be checked without asking the system: syntax, numbers, and that peers or security are not asked
/// for beside discovery servers. Errors: kInvalid with the field ("peers", "interfaces", "discovery_servers",
/// "security").
Status validate(const NetworkOptions& options);

}  // namespace gatefield::dds
