#pragma once

#include <fastdds/dds/domain/qos/DomainParticipantQos.hpp>
#include <fastdds/dds/publisher/qos/DataWriterQos.hpp>
#include <fastdds/dds/subscriber/qos/DataReaderQos.hpp>
#include <string>

#include "common/dds/credentials.h"
#include "common/dds/endpoint.h"
#include "common/dds/guarded_transport.h"

/// Every QoS and transport setting of the project, and the only place that has any. docs/wire.md says why each value is
/// what it is. Inside common/dds only.
namespace gatefield::dds {

/// UDP in packets that fit an Ethernet frame, large socket buffers, quick discovery and a short lease.
///
/// No shared memory, on one host neither. In Fast DDS 2.9.1 a datagram whose sender has gone before it was read stays
/// at the head of the receiver's queue for ever (SharedMemManager::Listener::pop() throws before it takes the cell
/// off), so that one client that leaves at the wrong moment makes the server, or another client, deaf; and every port
/// that a sender ever wrote to stays mapped. Over the loopback, states and commands are as fast (docs/performance.md).
///
/// Ports count from the domain's first one, whatever was opened before. Left alone, Fast DDS gives each participant of
/// a process the next two, and the 121st would listen where the next domain calls its members together.
eprosima::fastdds::dds::DomainParticipantQos participant_qos(std::uint32_t domain, const std::string& name,
                                                             const std::string& user_data,
                                                             const TransportOptions& transport,
                                                             AdmitsFragments admits_fragments, bool secured);
/// Authentication, access control and encryption by these files, of a domain where packets are checked as secured.
void secure(const Credentials& credentials, eprosima::fastdds::dds::DomainParticipantQos* qos);

eprosima::fastdds::dds::DataWriterQos writer_qos(Topic topic, const TransportOptions& transport);
eprosima::fastdds::dds::DataReaderQos reader_qos(Topic topic, const TransportOptions& transport);

/// Of topics that other programs have named: best effort and volatile, which a reader may ask of every writer, and
/// which a writer may offer to every reader that asks for no more (ROS calls it "sensor data").
eprosima::fastdds::dds::DataWriterQos foreign_writer_qos();
eprosima::fastdds::dds::DataReaderQos foreign_reader_qos();

/// The port at which a domain's participants call each other; theirs follow, up to the next domain's.
std::uint32_t first_port(std::uint32_t domain);

/// As foreign_writer_qos(), for small samples that are sent at once on the thread that writes them.
eprosima::fastdds::dds::DataWriterQos foreign_setpoint_qos();

/// The partition that a vehicle's commands travel in.
std::string command_partition(const std::string& vehicle);

/// Before the first participant of this process: samples always cross a transport, also between endpoints of one
/// process, so that callbacks run on the middleware's threads everywhere and never inside a publish call.
void prepare_process();

}  // namespace gatefield::dds
