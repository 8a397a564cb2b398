#pragma once

#include <fastdds/rtps/transport/ChainingTransportDescriptor.h>

#include <functional>
#include <memory>

#include "common/dds/endpoint.h"

/// Inside common/dds only.
namespace gatefield::dds {

/// UDP whose packets are read as RTPS before the library gets them (check_packet()), and dropped where they are wrong.
/// @param udp         what carries the packets
/// @param on_dropped  as TransportOptions::on_packets_dropped
std::shared_ptr<eprosima::fastdds::rtps::TransportDescriptorInterface> guarded(
    std::shared_ptr<eprosima::fastdds::rtps::TransportDescriptorInterface> udp,
    std::function<void(const DroppedPackets&)> on_dropped);

}  // namespace gatefield::dds
