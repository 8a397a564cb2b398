#pragma once

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

#include "common/dds/convert.h"
#include "common/dds/participant_id.h"
#include "common/dds/qos.h"
#include "common/dds/wire_type.h"
#include "gatefield_idl/gatefieldPubSubTypes.h"
#include "tests/support/dds_domain.h"
#include "tests/support/rtps_packet.h"

/// Packets that are put together byte by byte, in somebody's name.
namespace gatefield::dds {

using PacketBytes = std::vector<std::uint8_t>;

inline PacketBytes in_the_name_of(const ParticipantId& sender, PacketBytes packet) {
  constexpr std::size_t kSender = 8;
  std::copy(sender.bytes.begin(), sender.bytes.end(), packet.begin() + kSender);
  return packet;
}

/// A state as a writer says it, in the open.
inline PacketBytes plain_state(const eprosima::fastrtps::rtps::GUID_t& writer, const protocol::VehicleState& said) {
  WireType<wire::VehicleStatePubSubType> type;
  wire::VehicleState state;
  to_wire(said, &state);
  eprosima::fastrtps::rtps::SerializedPayload_t payload(4096);
  if (!type.serialize(&state, &payload)) return {};
  test::RtpsPacket packet;
  packet.begin(0x15, 4).u16(0).u16(16).u32(0);
  for (const auto byte : writer.entityId.value) packet.u8({byte});
  packet.sequence(static_cast<std::int64_t>(said.sequence));
  for (std::uint32_t i = 0; i < payload.length; ++i) packet.u8({payload.data[i]});
  ParticipantId sender;
  std::copy_n(writer.guidPrefix.value, sender.bytes.size(), sender.bytes.begin());
  return in_the_name_of(sender, packet.end().bytes());
}

/// A participant's word that it goes. @param sequence  of its announcements; one that was heard is not heard again
inline PacketBytes goodbye_of(const ParticipantId& participant, std::int64_t sequence) {
  test::RtpsPacket packet;
  packet.begin(0x15, 2 | 8).u16(0).u16(16).u32(0).u32(0xc2000100).sequence(sequence);
  const auto its_guid = [&] {
    for (const std::uint8_t byte : participant.bytes) packet.u8({byte});
    packet.u8({0, 0, 1, 0xc1});
  };
  packet.u16(0x70).u16(16);  // whose it is, where Fast DDS reads it
  its_guid();
  packet.u16(0x71).u16(4).u8({0, 0, 0, 3}).u16(1).u16(0).u8({0, 3, 0, 0, 0x50, 0, 16, 0});
  its_guid();
  packet.u8({1, 0, 0, 0});
  return in_the_name_of(participant, packet.end().bytes());
}

/// To every port that participants of this host have in the domain, whoever else is there: one that comes after many
/// others of the same process has a high one.
inline void send_to_all(const PacketBytes& packet) {
  const int out = socket(AF_INET, SOCK_DGRAM, 0);
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  for (std::uint32_t port = 10; port < 250; ++port) {
    to.sin_port = htons(static_cast<std::uint16_t>(first_port(test::own_domain()) + port));
    sendto(out, packet.data(), packet.size(), 0, reinterpret_cast<const sockaddr*>(&to), sizeof to);
  }
  close(out);
}

}  // namespace gatefield::dds
