#include "common/dds/discovery_server.h"

#include <string>
#include <utility>

#include "common/dds/participant.h"
#include "common/dds/reach.h"

namespace gatefield::dds {
namespace {

class Introducer final : public DiscoveryServer {
 public:
  explicit Introducer(std::unique_ptr<Participant> participant) : participant_(std::move(participant)) {}

 private:
  std::unique_ptr<Participant> participant_;
};

NetworkOptions on_interfaces_of(const NetworkOptions& network) {
  NetworkOptions own;
  own.interfaces = network.interfaces;
  return own;
}

}  // namespace

Result<std::unique_ptr<DiscoveryServer>> DiscoveryServer::open(std::uint32_t domain, std::uint16_t port,
                                                               const TransportOptions& transport) {
  TransportOptions own = transport;
  own.network = on_interfaces_of(transport.network);
  auto participant = Participant::open_discovery_server(domain, port, own);
  if (!participant) return participant.failure();
  return std::unique_ptr<DiscoveryServer>(std::make_unique<Introducer>(std::move(participant).value()));
}

Result<std::string> own_discovery_server(std::uint16_t port, const NetworkOptions& network) {
  const auto reach = resolve(on_interfaces_of(network));
  if (!reach) return reach.failure().within("network.", "network.");
  return (reach->interfaces.empty() ? "127.0.0.1" : reach->interfaces.front()) + ":" + std::to_string(port);
}

}  // namespace gatefield::dds
