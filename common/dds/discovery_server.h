#pragma once

#include <cstdint>
#include <memory>

#include "common/base/result.h"
#include "common/dds/endpoint.h"

namespace gatefield::dds {

/// Introduces the participants of a domain to each other that ask it (NetworkOptions::discovery_servers), where no
/// multicast is. It has id 0, as `fastdds discovery -i 0` would; what is read before it reads is read as everywhere.
/// Thread-safe: yes.
class DiscoveryServer {
 public:
  /// Listens at this port on the interfaces of transport.network; the rest of that is not used. Takes a second; when
  /// clients of a server before it call there already, as long as their lease, so that they notice the new one.
  /// Errors: the port is taken, an interface isn't there, the middleware refuses.
  static Result<std::unique_ptr<DiscoveryServer>> open(std::uint32_t domain, std::uint16_t port,
                                                       const TransportOptions& transport);
  virtual ~DiscoveryServer() = default;
};

/// The same host's way to it, as an entry of NetworkOptions::discovery_servers.
/// Errors: an interface isn't there.
Result<std::string> own_discovery_server(std::uint16_t port, const NetworkOptions& network);

}  // namespace gatefield::dds
