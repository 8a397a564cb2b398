#include "common/dds/qos.h"

#include <fastdds/rtps/attributes/ServerAttributes.h>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastrtps/utils/IPLocator.h>
#include <fastrtps/xmlparser/XMLProfileManager.h>

#include <algorithm>
#include <memory>
#include <mutex>
#include <random>
#include <utility>

#include "common/dds/guarded_transport.h"
#include "common/dds/library_log.h"
#include "common/dds/shared_memory.h"

namespace gatefield::dds {

using namespace eprosima::fastdds::dds;
using eprosima::fastrtps::Duration_t;

namespace {

// What we send at most in a packet: with its headers it stays below an Ethernet frame.
constexpr std::uint32_t kDatagram_bytes = 1400;
// In a closed domain: what fits into five of them. The library writes a handshake (with certificate and permissions)
// into a buffer of this size; one that it has to make larger is a byte too short (CDRMessage::addOctetVector).
constexpr std::uint32_t kClosedDatagram_bytes = 7300;
// What we take: other vendors' DDS send larger ones (Cyclone DDS up to 14720 bytes).
constexpr std::uint32_t kLongestDatagram_bytes = 65500;
constexpr std::uint32_t kSocketBuffer_bytes = 4 << 20;
constexpr std::uint32_t kPortsPerDomain = 250;
constexpr int kMaxVehicles = 256;   // instances that a reader or writer keeps apart
constexpr int kMaxRequests = 1024;  // of requests, which come from those who have no session, too

// Fast DDS has one setting for both: `maxMessageSize` sizes the receive buffers (longer packets are cut off and lost),
// while the size of what is sent is asked from this function.
class UdpInSmallPackets final : public eprosima::fastdds::rtps::UDPv4TransportDescriptor {
 public:
  explicit UdpInSmallPackets(std::uint32_t longest_bytes) : longest_bytes_(longest_bytes) {}
  std::uint32_t max_message_size() const override { return longest_bytes_; }

 private:
  const std::uint32_t longest_bytes_;
};

/// @param address  empty: every interface of this host
eprosima::fastrtps::rtps::Locator_t udp_locator(std::uint32_t port, const std::string& address = {}) {
  eprosima::fastrtps::rtps::Locator_t locator;
  locator.kind = LOCATOR_KIND_UDPv4;
  locator.port = port;
  if (address.empty())
    locator.set_Invalid_Address();
  else
    eprosima::fastrtps::rtps::IPLocator::setIPv4(locator, address);
  return locator;
}

Duration_t milliseconds(int ms) { return {ms / 1000, static_cast<std::uint32_t>(ms % 1000) * 1'000'000u}; }

int history_depth(Topic topic, const TransportOptions& transport) {
  if (topic == Topic::kPilotRecord) return 2;  // what is withdrawn next must not take the last word's place
  return topic == Topic::kDepthFrame ? std::clamp(transport.depth_history, 1, 64) : 1;
}

bool reliable(Topic topic) {
  return topic != Topic::kVehicleState && topic != Topic::kTelemetry && topic != Topic::kServerStatus;
}
bool transient_local(Topic topic) { return topic == Topic::kSessionRequest || topic == Topic::kSessionReply; }

// What is long and of any length: a depth frame's type may hold 6.5 MB. Its memory grows to the size in use instead.
bool long_samples(Topic topic) { return topic == Topic::kDepthFrame || topic == Topic::kPilotRecord; }

eprosima::fastrtps::rtps::MemoryManagementPolicy_t memory(Topic topic) {
  return long_samples(topic) ? eprosima::fastrtps::rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE
                             : eprosima::fastrtps::rtps::PREALLOCATED_MEMORY_MODE;
}

ResourceLimitsQosPolicy limits(Topic topic, int depth) {
  const int instances = topic == Topic::kSessionRequest ? kMaxRequests : kMaxVehicles;
  ResourceLimitsQosPolicy policy;
  policy.max_samples_per_instance = depth;
  policy.max_instances = instances;
  policy.max_samples = instances * depth;
  policy.allocated_samples = 2 * depth;
  policy.extra_samples = 4;
  return policy;
}

// What writers and readers of a topic have in common; both QoS classes name it alike.
template <typename Qos>
void fill_common(Topic topic, int depth, Qos* qos) {
  qos->reliability().kind = reliable(topic) ? RELIABLE_RELIABILITY_QOS : BEST_EFFORT_RELIABILITY_QOS;
  qos->durability().kind = transient_local(topic) ? TRANSIENT_LOCAL_DURABILITY_QOS : VOLATILE_DURABILITY_QOS;
  qos->history().kind = KEEP_LAST_HISTORY_QOS;
  qos->history().depth = depth;
  qos->resource_limits() = limits(topic, depth);
  qos->endpoint().history_memory_policy = memory(topic);
  qos->data_sharing().off();  // refuses keyed types
  if (topic == Topic::kCommand) {
    qos->ownership().kind = EXCLUSIVE_OWNERSHIP_QOS;
    qos->deadline().period = milliseconds(50);
    qos->liveliness().kind = MANUAL_BY_TOPIC_LIVELINESS_QOS;
    qos->liveliness().lease_duration = milliseconds(100);
  }
}

template <typename Qos>
void fill_foreign(Qos* qos) {
  constexpr int kDepth = 8;  // what comes in one go when a thread was held up
  qos->reliability().kind = BEST_EFFORT_RELIABILITY_QOS;
  qos->durability().kind = VOLATILE_DURABILITY_QOS;
  qos->history().kind = KEEP_LAST_HISTORY_QOS;
  qos->history().depth = kDepth;
  qos->endpoint().history_memory_policy = eprosima::fastrtps::rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
  qos->data_sharing().off();
}

/// Found by multicast, and by calling each peer that is named.
void find_by_calling(std::uint32_t domain, const Reach& reach, WireProtocolConfigQos* wire) {
  auto& builtin = wire->builtin;
  const std::uint32_t base = first_port(domain);
  const auto everybody = udp_locator(base, "239.255.0.1");
  builtin.metatrafficMulticastLocatorList.push_back(everybody);
  if (reach.peers.empty()) return;
  builtin.initialPeersList.push_back(everybody);
  for (const PeerHost& peer : reach.peers)
    for (int number = peer.first; number <= peer.last; ++number)
      builtin.initialPeersList.push_back(
          udp_locator(first_own_port(domain) + 2u * static_cast<unsigned>(number), peer.address));
}

/// Found through discovery servers alone.
void find_by_asking(const Reach& reach, WireProtocolConfigQos* wire) {
  auto& discovery = wire->builtin.discovery_config;
  discovery.discoveryProtocol = eprosima::fastrtps::rtps::DiscoveryProtocol_t::CLIENT;
  discovery.discoveryServer_client_syncperiod = milliseconds(250);
  for (const DiscoveryAddress& server : reach.discovery_servers) {
    eprosima::fastdds::rtps::RemoteServerAttributes remote;
    eprosima::fastdds::rtps::get_server_client_default_guidPrefix(server.id, remote.guidPrefix);
    remote.metatrafficUnicastLocatorList.push_back(udp_locator(server.port, server.address));
    discovery.m_DiscoveryServers.push_back(std::move(remote));
  }
}

std::shared_ptr<UdpInSmallPackets> udp_transport(const Reach& reach, bool closed) {
  auto udp = std::make_shared<UdpInSmallPackets>(closed ? kClosedDatagram_bytes : kDatagram_bytes);
  udp->maxMessageSize = kLongestDatagram_bytes;
  udp->sendBufferSize = kSocketBuffer_bytes;
  udp->receiveBufferSize = kSocketBuffer_bytes;
  udp->interfaceWhiteList = reach.interfaces;
  return udp;
}

/// Of all 30 bits, so that none is ever used twice: whoever wrote to a port keeps it, and would write to that of a dead
/// program for ever when the number is a new one's.
std::uint32_t unused_shared_port() {
  constexpr std::uint32_t kFirst = 1u << 17, kLast = 1u << 30;  // above those of UDP
  std::random_device device;
  return std::uniform_int_distribution<std::uint32_t>(kFirst, kLast)(device);
}

/// What everybody has, whichever way others are found.
void fill_common(const Reach& reach, Guard guard, DomainParticipantQos* qos) {
  auto& discovery = qos->wire_protocol().builtin.discovery_config;
  discovery.leaseDuration = milliseconds(static_cast<int>(kLease.count()));
  discovery.leaseDuration_announcementperiod = milliseconds(500);
  qos->transport().use_builtin_transports = false;
  qos->transport().send_socket_buffer_size = kSocketBuffer_bytes;
  qos->transport().listen_socket_buffer_size = kSocketBuffer_bytes;
  auto below = udp_transport(reach, guard.closed);
  qos->transport().user_transports.push_back(guarded(std::move(below), std::move(guard)));
}

/// Authentication, access control and encryption by these files.
void secure(const Credentials& credentials, DomainParticipantQos* qos) {
  const auto set = [qos](const std::string& name, const std::string& value) {
    qos->properties().properties().emplace_back("dds.sec." + name, value);
  };
  const auto file = [](const std::filesystem::path& path) { return "file://" + path.string(); };
  set("auth.plugin", "builtin.PKI-DH");
  set("auth.builtin.PKI-DH.identity_ca", file(credentials.identity_authority));
  set("auth.builtin.PKI-DH.identity_certificate", file(credentials.certificate));
  set("auth.builtin.PKI-DH.private_key", file(credentials.key));
  set("auth.builtin.PKI-DH.identity_crl", file(credentials.revoked));
  set("access.plugin", "builtin.Access-Permissions");
  set("access.builtin.Access-Permissions.permissions_ca", file(credentials.permissions_authority));
  set("access.builtin.Access-Permissions.governance", file(credentials.governance));
  set("access.builtin.Access-Permissions.permissions", file(credentials.permissions));
  set("crypto.plugin", "builtin.AES-GCM-GMAC");
}

}  // namespace

DomainParticipantQos participant_qos(std::uint32_t domain, const std::string& name, const std::string& user_data,
                                     const TransportOptions& transport, const Reach& reach,
                                     AdmitsFragments admits_fragments, const Credentials* credentials) {
  DomainParticipantQos qos;
  qos.name(name.c_str());
  qos.user_data().setValue(std::vector<std::uint8_t>(user_data.begin(), user_data.end()));
  auto& wire = qos.wire_protocol();
  // The ports of the RTPS specification for the first participant of a host; those that are taken are passed over.
  const std::uint32_t own_port = first_own_port(domain);
  wire.builtin.metatrafficUnicastLocatorList.push_back(udp_locator(own_port));
  wire.builtin.mutation_tries = (kPortsPerDomain - 12) / 2;
  wire.default_unicast_locator_list.push_back(udp_locator(own_port + 1));
  if (reach.discovery_servers.empty())
    find_by_calling(domain, reach, &wire);
  else
    find_by_asking(reach, &wire);
  Guard guard{transport.on_packets_dropped, std::move(admits_fragments), credentials != nullptr};
  if (credentials != nullptr) secure(*credentials, &qos);
  if (transport.network.shared_memory) {
    // First, so that it is chosen where both would do.
    const auto shared = std::make_shared<SharedMemory>(transport.on_deaf);
    wire.default_unicast_locator_list.push_back(shared->locator(unused_shared_port()));
    qos.transport().user_transports.push_back(guarded(shared, guard));
  }
  fill_common(reach, std::move(guard), &qos);
  return qos;
}

DomainParticipantQos discovery_server_qos(std::uint16_t port, const TransportOptions& transport, const Reach& reach) {
  DomainParticipantQos qos;
  qos.name("gatefield-discovery");
  auto& wire = qos.wire_protocol();
  eprosima::fastdds::rtps::get_server_client_default_guidPrefix(0, wire.prefix);
  auto& builtin = wire.builtin;
  builtin.discovery_config.discoveryProtocol = eprosima::fastrtps::rtps::DiscoveryProtocol_t::SERVER;
  builtin.metatrafficUnicastLocatorList.push_back(udp_locator(port));
  builtin.mutation_tries = 0;
  fill_common(reach, {transport.on_packets_dropped, {}, false}, &qos);
  return qos;
}

DataWriterQos writer_qos(Topic topic, const TransportOptions& transport) {
  DataWriterQos qos;
  fill_common(topic, history_depth(topic, transport), &qos);
  qos.publish_mode().kind = long_samples(topic) ? ASYNCHRONOUS_PUBLISH_MODE : SYNCHRONOUS_PUBLISH_MODE;
  qos.reliability().max_blocking_time = milliseconds(topic == Topic::kDepthFrame ? 5 : 100);
  qos.writer_data_lifecycle().autodispose_unregistered_instances = true;
  // Expressions of filters come from whoever reads: none is parsed here.
  qos.writer_resource_limits().reader_filters_allocation = {0, 0};
  if (topic == Topic::kVehicleState) {
    // Offered for those who want to watch; our server judges a silent vehicle by its own clock.
    qos.liveliness().kind = MANUAL_BY_TOPIC_LIVELINESS_QOS;
    qos.liveliness().lease_duration = milliseconds(200);
  }
  if (reliable(topic)) {
    auto& times = qos.reliable_writer_qos().times;
    times.heartbeatPeriod = milliseconds(transient_local(topic) ? 100 : 10);
    times.nackResponseDelay = milliseconds(0);
    // A heartbeat in every command's packet would be made, and when encrypted that takes its time, before the command
    // leaves; the next one is never far.
    qos.reliable_writer_qos().disable_heartbeat_piggyback = topic == Topic::kCommand;
  }
  return qos;
}

DataReaderQos reader_qos(Topic topic, const TransportOptions& transport) {
  DataReaderQos qos;
  // Two clients of one name are two writers of one instance: what each said must stay readable.
  const int depth = topic == Topic::kSessionRequest ? 4 : history_depth(topic, transport);
  fill_common(topic, depth, &qos);
  // Kept for the next sample, each place of a history would grow to the largest camera that it ever met, and stay so.
  if (long_samples(topic)) qos.endpoint().history_memory_policy = eprosima::fastrtps::rtps::DYNAMIC_RESERVE_MEMORY_MODE;
  if (reliable(topic)) qos.reliable_reader_qos().times.heartbeatResponseDelay = milliseconds(0);
  return qos;
}

DataWriterQos foreign_writer_qos() {
  DataWriterQos qos;
  fill_foreign(&qos);
  qos.publish_mode().kind = ASYNCHRONOUS_PUBLISH_MODE;  // an image is hundreds of packets
  return qos;
}

DataReaderQos foreign_reader_qos() {
  DataReaderQos qos;
  fill_foreign(&qos);
  return qos;
}

std::uint32_t first_port(std::uint32_t domain) { return 7400 + kPortsPerDomain * domain; }
std::uint32_t first_own_port(std::uint32_t domain) { return first_port(domain) + 10; }

DataWriterQos foreign_setpoint_qos() {
  DataWriterQos qos = foreign_writer_qos();
  qos.publish_mode().kind = SYNCHRONOUS_PUBLISH_MODE;
  return qos;
}

std::string command_partition(const std::string& vehicle) { return "gatefield/" + vehicle; }

void prepare_process() {
  static std::once_flag once;
  std::call_once(once, [] {
    eprosima::fastrtps::LibrarySettingsAttributes settings;
    settings.intraprocess_delivery = eprosima::fastrtps::INTRAPROCESS_OFF;
    eprosima::fastrtps::xmlparser::XMLProfileManager::library_settings(settings);
    limit_library_log();
  });
}

}  // namespace gatefield::dds
