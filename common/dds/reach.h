#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/dds/network.h"

/// What NetworkOptions come to on this host, now. Inside common/dds only.
namespace gatefield::dds {

/// Participants of one host: each listens at ports of its number (first_port() and so on).
struct PeerHost {
  std::string address;  ///< "10.0.0.7"
  int first = 0, last = 0;
};

/// A discovery server.
struct DiscoveryAddress {
  int id = 0;
  std::string address;
  std::uint16_t port = 0;
};

struct Reach {
  std::vector<PeerHost> peers;
  std::vector<std::string> interfaces;  ///< their addresses; empty: all
  std::vector<DiscoveryAddress> discovery_servers;
};

/// Looks names up, once: hosts by the system's resolver, interfaces among those of this host. Where no discovery server
/// is named, those of ROS_DISCOVERY_SERVER are taken, "10.0.0.7:11811;10.0.0.8": Fast DDS would take them by itself,
/// and ignore what it can't read.
/// Errors: those of validate(), and kUnknownName for a host that has no IPv4 address or an interface that isn't there.
/// Thread-safe: yes.   Real-time safe: no (may wait for a name server for as long as the system is set to).
Result<Reach> resolve(const NetworkOptions& options);

}  // namespace gatefield::dds
