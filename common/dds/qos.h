#pragma once

#include <chrono>
#include <fastdds/dds/domain/qos/DomainParticipantQos.hpp>
#include <fastdds/dds/publisher/qos/DataWriterQos.hpp>
#include <fastdds/dds/subscriber/qos/DataReaderQos.hpp>
#include <string>

#include "common/dds/credentials.h"
#include "common/dds/endpoint.h"
#include "common/dds/guarded_transport.h"
#include "common/dds/reach.h"

/// Every QoS and transport setting of the project, and the only place that has any. docs/wire.md says why each value is
/// what it is. Inside common/dds only.
namespace gatefield::dds {

/// A participant that says nothing for so long is given up.
inline constexpr std::chrono::milliseconds kLease{3000};

/// UDP in packets that fit an Ethernet frame, large socket buffers, quick discovery and a short lease; peers,
/// interfaces and discovery servers as told.
///
/// Shared memory only when asked for (decision 0046): for samples alone, beside UDP, and watched
/// (SharedMemory).
///
/// Ports count from the domain's first one, whatever was opened before. Left alone, Fast DDS gives each participant of
/// a process the next two, and the 121st would listen where the next domain calls its members together.
///
/// @param credentials  for authentication, access control and encryption; nullptr: the domain is open
eprosima::fastdds::dds::DomainParticipantQos participant_qos(std::uint32_t domain, const std::string& name,
                                                             const std::string& user_data,
                                                             const TransportOptions& transport, const Reach& reach,
                                                             AdmitsFragments admits_fragments,
                                                             const Credentials* credentials);

/// Of a discovery server with id 0, which listens at this port alone.
eprosima::fastdds::dds::DomainParticipantQos discovery_server_qos(std::uint16_t port, const TransportOptions& transport,
                                                                  const Reach& reach);

eprosima::fastdds::dds::DataWriterQos writer_qos(Topic topic, const TransportOptions& transport);
eprosima::fastdds::dds::DataReaderQos reader_qos(Topic topic, const TransportOptions& transport);

/// Of topics that other programs have named: best effort and volatile, which a reader may ask of every writer, and
/// which a writer may offer to every reader that asks for no more (ROS calls it "sensor data").
eprosima::fastdds::dds::DataWriterQos foreign_writer_qos();
eprosima::fastdds::dds::DataReaderQos foreign_reader_qos();

/// The port at which a domain's participants call each other; theirs follow, up to the next domain's.
std::uint32_t first_port(std::uint32_t domain);
/// Where participant 0 of a host is called alone, and hears samples one above; the next one's are two above.
std::uint32_t first_own_port(std::uint32_t domain);

/// As foreign_writer_qos(), for small samples that are sent at once on the thread that writes them.
eprosima::fastdds::dds::DataWriterQos foreign_setpoint_qos();

/// The partition that a vehicle's commands travel in.
std::string command_partition(const std::string& vehicle);

/// Before the first participant of this process: samples always cross a transport, also between endpoints of one
/// process, so that callbacks run on the middleware's threads everywhere and never inside a publish call.
void prepare_process();

}  // namespace gatefield::dds
