#include "common/dds/qos.h"

#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastrtps/utils/IPLocator.h>
#include <fastrtps/xmlparser/XMLProfileManager.h>

#include <algorithm>
#include <memory>
#include <mutex>
#include <utility>

#include "common/dds/guarded_transport.h"
#include "common/dds/library_log.h"

namespace gatefield::dds {

using namespace eprosima::fastdds::dds;
using eprosima::fastrtps::Duration_t;

namespace {

// What we send at most in a packet: with its headers it stays below an Ethernet frame.
constexpr std::uint32_t kDatagram_bytes = 1400;
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
  std::uint32_t max_message_size() const override { return kDatagram_bytes; }
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

bool reliable(Topic topic) { return topic != Topic::kVehicleState && topic != Topic::kTelemetry; }
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

}  // namespace

DomainParticipantQos participant_qos(std::uint32_t domain, const std::string& name, const std::string& user_data,
                                     const TransportOptions& transport, AdmitsFragments admits_fragments) {
  DomainParticipantQos qos;
  qos.name(name.c_str());
  qos.user_data().setValue(std::vector<std::uint8_t>(user_data.begin(), user_data.end()));

  auto& discovery = qos.wire_protocol().builtin.discovery_config;
  discovery.leaseDuration = milliseconds(3000);
  discovery.leaseDuration_announcementperiod = milliseconds(500);

  // The ports of the RTPS specification for the first participant of a host; those that are taken are passed over.
  auto& builtin = qos.wire_protocol().builtin;
  const std::uint32_t base = first_port(domain);
  builtin.metatrafficMulticastLocatorList.push_back(udp_locator(base, "239.255.0.1"));
  builtin.metatrafficUnicastLocatorList.push_back(udp_locator(base + 10));
  qos.wire_protocol().default_unicast_locator_list.push_back(udp_locator(base + 11));
  builtin.mutation_tries = (kPortsPerDomain - 12) / 2;

  qos.transport().use_builtin_transports = false;
  qos.transport().send_socket_buffer_size = kSocketBuffer_bytes;
  qos.transport().listen_socket_buffer_size = kSocketBuffer_bytes;
  auto udp = std::make_shared<UdpInSmallPackets>();
  udp->maxMessageSize = kLongestDatagram_bytes;
  udp->sendBufferSize = kSocketBuffer_bytes;
  udp->receiveBufferSize = kSocketBuffer_bytes;
  qos.transport().user_transports.push_back(
      guarded(std::move(udp), transport.on_packets_dropped, std::move(admits_fragments)));
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
  }
  return qos;
}

DataReaderQos reader_qos(Topic topic, const TransportOptions& transport) {
  DataReaderQos qos;
  // Two clients of one name are two writers of one instance: what each said must stay readable.
  const int depth = topic == Topic::kSessionRequest ? 4 : history_depth(topic, transport);
  fill_common(topic, depth, &qos);
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
