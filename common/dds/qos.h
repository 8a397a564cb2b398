#pragma once

#include <fastdds/dds/domain/qos/DomainParticipantQos.hpp>
#include <fastdds/dds/publisher/qos/DataWriterQos.hpp>
#include <fastdds/dds/subscriber/qos/DataReaderQos.hpp>
#include <string>

#include "common/dds/endpoint.h"

/// Every QoS and transport setting of the project, and the only place that has any. docs/wire.md says why each value is
/// what it is. Inside common/dds only.
namespace gatefield::dds {

/// UDP in packets that fit an Ethernet frame, large socket buffers, shared memory on the same host, quick discovery and
/// a short lease.
eprosima::fastdds::dds::DomainParticipantQos participant_qos(const std::string& name, const std::string& user_data,
                                                             const TransportOptions& transport);

eprosima::fastdds::dds::DataWriterQos writer_qos(Topic topic, const TransportOptions& transport);
eprosima::fastdds::dds::DataReaderQos reader_qos(Topic topic, const TransportOptions& transport);

/// The partition that a vehicle's commands travel in.
std::string command_partition(const std::string& vehicle);

/// Before the first participant of this process: samples always cross a transport, also between endpoints of one
/// process, so that callbacks run on the middleware's threads everywhere and never inside a publish call.
void prepare_process();

}  // namespace gatefield::dds
