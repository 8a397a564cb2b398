#include "common/dds/network.h"

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <netdb.h>
#include <netinet/in.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <memory>
#include <optional>
#include <string_view>
#include <utility>

#include "common/base/text.h"
#include "common/dds/reach.h"

namespace gatefield::dds {
namespace {

constexpr int kFirstPeers = 9;  // numbers 0 to this, unless told
constexpr int kLastParticipant = 118;
constexpr std::size_t kLongestHost = 253;

constexpr const char* kDiscoveryVariable = "ROS_DISCOVERY_SERVER";

constexpr const char* kPeerExpected =
    "HOST or HOST:FIRST-LAST, such as 10.0.0.7 or 10.0.0.7:0-24, participants 0 to 118 (IPv4, no port)";
constexpr const char* kServerExpected = "HOST:PORT, such as 10.0.0.7:11811, port 1 to 65535 (IPv4)";

std::string quoted(const std::string& text) { return "'" + shown(text, 80) + "'"; }

std::optional<int> number(std::string_view digits, int lowest, int highest) {
  int value = 0;
  const auto [end, failed] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (failed != std::errc() || end != digits.data() + digits.size() || value < lowest || value > highest)
    return std::nullopt;
  return value;
}

bool host_like(std::string_view host) {
  const auto fits = [](char c) {
    return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '.' || c == '-' ||
           c == '_';
  };
  return !host.empty() && host.size() <= kLongestHost && std::all_of(host.begin(), host.end(), fits);
}

/// `address` is still what the person wrote.
std::optional<PeerHost> parse_peer(std::string_view text) {
  PeerHost peer{.address = std::string(text.substr(0, text.find(':'))), .first = 0, .last = kFirstPeers};
  if (!host_like(peer.address)) return std::nullopt;
  if (text.size() == peer.address.size()) return peer;
  text.remove_prefix(peer.address.size() + 1);
  const std::size_t dash = text.find('-');
  const auto first = number(text.substr(0, dash), 0, kLastParticipant);
  const auto last = dash == std::string_view::npos ? first : number(text.substr(dash + 1), 0, kLastParticipant);
  if (!first || !last || *last < *first) return std::nullopt;
  peer.first = *first;
  peer.last = *last;
  return peer;
}

std::optional<DiscoveryAddress> parse_server(std::string_view text) {
  const std::size_t colon = text.find(':');
  if (colon == std::string_view::npos || !host_like(text.substr(0, colon))) return std::nullopt;
  const auto port = number(text.substr(colon + 1), 1, 65535);
  if (!port) return std::nullopt;
  return DiscoveryAddress{0, std::string(text.substr(0, colon)), static_cast<std::uint16_t>(*port)};
}

/// At most so many of a field, and each as its check wants it.
Status validate_list(const std::string& field, const std::vector<std::string>& list, std::size_t most,
                     Status (*check)(const std::string&)) {
  if (list.size() > most) return Error::invalid(field, text(list.size()) + " of them", "at most " + text(most));
  for (const std::string& one : list)
    if (Status status = check(one); !status) {
      Error error = status.failure().within(field + " is ");
      error.field = field;
      return error;
    }
  return {};
}

Error bad_entry(const std::string& value, const std::string& expected, ErrorCode code = ErrorCode::kInvalid) {
  Error error(quoted(value) + ", expected " + expected, code);
  error.value = value;
  error.expected = expected;
  return error;
}

Status validate_interface(const std::string& name) {
  constexpr std::size_t kLongest = 15;  // of an interface's name, and of an address
  if (!name.empty() && name.size() <= kLongest && printable(name)) return {};
  return bad_entry(name, "an interface's name or IPv4 address, such as eth0 or 10.0.0.5");
}

std::string address_text(const in_addr& address) {
  char buffer[INET_ADDRSTRLEN] = {};
  inet_ntop(AF_INET, &address, buffer, sizeof buffer);
  return buffer;
}

Result<std::string> look_up(const std::string& field, const std::string& host) {
  addrinfo hints{};
  hints.ai_family = AF_INET;
  hints.ai_socktype = SOCK_DGRAM;
  addrinfo* found = nullptr;
  const int failed = getaddrinfo(host.c_str(), nullptr, &hints, &found);
  const std::unique_ptr<addrinfo, decltype(&freeaddrinfo)> kept(found, freeaddrinfo);
  if (failed == 0 && found != nullptr)
    return address_text(reinterpret_cast<const sockaddr_in*>(found->ai_addr)->sin_addr);
  return Error::invalid(field, quoted(host) + ", which is looked up in vain (" + gai_strerror(failed) + ")",
                        "an IPv4 address, or a name that getent hosts finds on this machine", ErrorCode::kUnknownName);
}

/// Of this host's interfaces that are up: name and IPv4 address.
std::vector<std::pair<std::string, std::string>> interfaces_here() {
  std::vector<std::pair<std::string, std::string>> found;
  ifaddrs* list = nullptr;
  if (getifaddrs(&list) != 0) return found;
  const std::unique_ptr<ifaddrs, decltype(&freeifaddrs)> kept(list, freeifaddrs);
  for (const ifaddrs* one = list; one != nullptr; one = one->ifa_next)
    if (one->ifa_addr != nullptr && one->ifa_addr->sa_family == AF_INET)
      found.emplace_back(one->ifa_name, address_text(reinterpret_cast<const sockaddr_in*>(one->ifa_addr)->sin_addr));
  return found;
}

/// Every address of the interfaces that are named.
Status resolve_interfaces(const std::vector<std::string>& named, std::vector<std::string>* addresses) {
  if (named.empty()) return {};
  const auto here = interfaces_here();
  for (const std::string& name : named) {
    const std::size_t before = addresses->size();
    for (const auto& [interface, address] : here)
      if (name == interface || name == address) addresses->push_back(address);
    if (addresses->size() > before) continue;
    std::string known;
    for (const auto& [interface, address] : here) known += (known.empty() ? "" : ", ") + interface + " " + address;
    return Error::invalid("interfaces", quoted(name),
                          "one with an IPv4 address: " + (known.empty() ? "this host has none that is up" : known),
                          ErrorCode::kUnknownName);
  }
  return {};
}

/// Of ROS_DISCOVERY_SERVER: an entry each as parse_server() takes it, empty where the list leaves an id out.
Result<std::vector<std::string>> servers_of_environment(const NetworkOptions& options) {
  std::vector<std::string> servers;
  const char* const told = std::getenv(kDiscoveryVariable);
  if (told == nullptr || *told == '\0') return servers;
  const std::string list = told;
  if (!options.peers.empty())
    return Error::invalid("peers", "given while " + std::string(kDiscoveryVariable) + " is set",
                          "one of the two: unset the variable, or leave the peers out");
  for (std::size_t begin = 0; begin <= list.size();) {
    const std::size_t end = std::min(list.find(';', begin), list.size());
    std::string one = list.substr(begin, end - begin);
    if (!one.empty() && one.find(':') == std::string::npos) one += ":11811";
    if (!one.empty() && !parse_server(one))
      return Error::invalid(kDiscoveryVariable, quoted(list), "HOST or HOST:PORT, several with ; between (IPv4)");
    servers.push_back(std::move(one));
    begin = end + 1;
  }
  if (servers.size() <= kMaxDiscoveryServers) return servers;
  return Error::invalid(kDiscoveryVariable, text(servers.size()) + " servers", "at most " + text(kMaxDiscoveryServers));
}

/// A discovery server tells everybody of everybody, unencrypted.
Status validate_security(const NetworkOptions& options, bool asks_discovery_servers) {
  if (options.security.empty() || !asks_discovery_servers) return {};
  return Error::invalid("security", quoted(options.security),
                        "none beside discovery servers: a closed domain finds its members by multicast or peers");
}

}  // namespace

Status validate_peer(const std::string& peer) {
  return parse_peer(peer) ? Status() : Status(bad_entry(peer, kPeerExpected));
}

Status validate_discovery_server(const std::string& server) {
  return parse_server(server) ? Status() : Status(bad_entry(server, kServerExpected));
}

Status validate(const NetworkOptions& options) {
  if (Status status = validate_list("peers", options.peers, kMaxPeers, validate_peer); !status) return status;
  if (Status status = validate_list("interfaces", options.interfaces, kMaxInterfaces, validate_interface); !status)
    return status;
  if (Status status = validate_list("discovery_servers", options.discovery_servers, kMaxDiscoveryServers,
                                    validate_discovery_server);
      !status)
    return status;
  if (!options.peers.empty() && !options.discovery_servers.empty())
    return Error::invalid("peers", "given beside discovery_servers",
                          "one of the two: who asks a discovery server calls nobody else");
  return validate_security(options, !options.discovery_servers.empty());
}

Result<Reach> resolve(const NetworkOptions& options) {
  if (Status status = validate(options); !status) return status.failure();
  if (options.shared_memory && access("/dev/shm", W_OK | X_OK) != 0)
    return Error::invalid("shared_memory", "true", "a folder /dev/shm that may be written to");
  Reach reach;
  for (const std::string& one : options.peers) {
    PeerHost peer = *parse_peer(one);
    auto address = look_up("peers", peer.address);
    if (!address) return address.failure();
    peer.address = *address;
    reach.peers.push_back(std::move(peer));
  }
  const auto servers = options.discovery_servers.empty() ? servers_of_environment(options)
                                                         : Result<std::vector<std::string>>(options.discovery_servers);
  if (!servers) return servers.failure();
  if (Status status = validate_security(options, !servers->empty()); !status) return status.failure();
  int id = 0;
  for (const std::string& one : *servers) {
    if (!one.empty()) {
      DiscoveryAddress server = *parse_server(one);
      auto address = look_up("discovery_servers", server.address);
      if (!address) return address.failure();
      server.id = id;
      server.address = *address;
      reach.discovery_servers.push_back(std::move(server));
    }
    ++id;
  }
  if (Status status = resolve_interfaces(options.interfaces, &reach.interfaces); !status) return status.failure();
  return reach;
}

}  // namespace gatefield::dds
