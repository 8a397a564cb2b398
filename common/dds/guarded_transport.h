#pragma once

#include <fastdds/rtps/transport/ChainingTransportDescriptor.h>

#include <cstdint>
#include <functional>
#include <memory>

#include "common/dds/endpoint.h"
#include "common/dds/participant_id.h"
#include "common/dds/shared_memory.h"

/// Inside common/dds only.
namespace gatefield::dds {

/// Whether somebody may send a sample of this size in fragments, for which memory is set aside before it is whole.
/// Called on receiving threads.
using AdmitsFragments = std::function<bool(const ParticipantId& from, std::uint32_t sample_bytes)>;

/// What stands before the library.
struct Guard {
  std::function<void(const DroppedPackets&)> on_dropped;  ///< as TransportOptions::on_packets_dropped
  AdmitsFragments admits_fragments;                       ///< may be empty: everybody may
  bool closed = false;  ///< to strangers: what is not protected is dropped, too (ClosedDomain)
};

/// A transport whose packets are read as RTPS before the library gets them (check_packet()), and dropped where they are
/// wrong.
/// @param carrier  what carries the packets
std::shared_ptr<eprosima::fastdds::rtps::TransportDescriptorInterface> guarded(
    std::shared_ptr<eprosima::fastdds::rtps::TransportDescriptorInterface> carrier, Guard guard);

/// The same of shared memory. @param shared_memory  watches it
std::shared_ptr<eprosima::fastdds::rtps::TransportDescriptorInterface> guarded(
    std::shared_ptr<SharedMemory> shared_memory, Guard guard);

/// Whose packet the library is reading on this thread; nullptr: none.
const ParticipantId* packet_sender() noexcept;

}  // namespace gatefield::dds
