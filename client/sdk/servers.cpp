#include "gatefield/sdk/servers.h"

#include "common/dds/server_listing.h"

namespace gatefield::sdk {

Result<std::vector<protocol::ServerStatus>> find_servers(std::uint32_t domain, const dds::NetworkOptions& network,
                                                         std::chrono::milliseconds wait,
                                                         const std::atomic<bool>* cancel) {
  return dds::list_servers(domain, network, wait, cancel);
}

}  // namespace gatefield::sdk
