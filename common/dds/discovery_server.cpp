#include "common/dds/discovery_server.h"

#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <string>
#include <thread>
#include <utility>

#include "common/dds/participant.h"
#include "common/dds/qos.h"
#include "common/dds/reach.h"

namespace gatefield::dds {
namespace {

using namespace std::chrono_literals;

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

class Socket {
 public:
  Socket() : file_(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {}
  ~Socket() {
    if (file_ >= 0) close(file_);
  }
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;
  int file() const { return file_; }

 private:
  int file_;
};

/// Clients of a server that was killed take one that comes back within the lease for the same one, and tell it nothing
/// (its id is the same). They are heard calling; then their lease has to run out first.
Status let_leases_run_out(std::uint16_t port) {
  constexpr std::chrono::milliseconds kListen = 1000ms;  // clients announce themselves twice a second
  const Socket ear;
  sockaddr_in here{};
  here.sin_family = AF_INET;
  here.sin_port = htons(port);
  if (bind(ear.file(), reinterpret_cast<const sockaddr*>(&here), sizeof here) != 0)
    return Error("UDP port " + std::to_string(port) + " could not be taken for a discovery server (" +
                 std::strerror(errno) + "), expected one that is free");
  pollfd waited{ear.file(), POLLIN, 0};
  if (poll(&waited, 1, static_cast<int>(kListen.count())) > 0) std::this_thread::sleep_for(kLease + 500ms);
  return {};
}

}  // namespace

Result<std::unique_ptr<DiscoveryServer>> DiscoveryServer::open(std::uint32_t domain, std::uint16_t port,
                                                               const TransportOptions& transport) {
  TransportOptions own = transport;
  own.network = on_interfaces_of(transport.network);
  if (Status status = let_leases_run_out(port); !status) return status.failure();
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
