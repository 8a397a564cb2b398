#include "common/dds/announcements.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <vector>

#include "common/dds/packet_check.h"
#include "tests/support/rtps_packet.h"

namespace gatefield::dds {
namespace {

using test::RtpsPacket;

// As little endian numbers: of participants and of requests.
constexpr std::uint32_t kParticipants = 0xc2000100, kRequests = 0x02010000;

/// @param status  of the instance, bits as DDSI-RTPS 9.6.3.9 has them: 1 disposed, 2 unregistered
RtpsPacket key_of_an_instance(std::uint32_t writer, int status) {
  RtpsPacket packet;
  packet.begin(0x15, 2 | 8).u16(0).u16(16).u32(0).u32(writer).sequence(2);
  packet.u16(0x71).u16(4).u8({0, 0, 0, status}).u16(1).u16(0);
  packet.u8({0, 3, 0, 0}).zeros(16);
  return packet.end();
}

bool says(const RtpsPacket& packet) {
  const auto bytes = packet.bytes();
  EXPECT_EQ(check_packet(bytes).fault, PacketFault::kNone) << "not what is tested here";
  return says_goodbye(bytes);
}

TEST(Announcements, WhoSaysThatItGoesIsHeard) {
  EXPECT_TRUE(says(key_of_an_instance(kParticipants, 3)));
  EXPECT_TRUE(says(key_of_an_instance(kParticipants, 1)));
  EXPECT_TRUE(says(key_of_an_instance(kParticipants, 2)));
}

TEST(Announcements, WhatEndsOtherThingsIsNoGoodbye) {
  EXPECT_FALSE(says(key_of_an_instance(kRequests, 3))) << "a request that is withdrawn";
  RtpsPacket announcement;
  announcement.begin(0x15, 4).u16(0).u16(16).u32(0).u32(kParticipants).sequence(1);
  announcement.u8({0, 3, 0, 0}).u16(1).u16(0);
  EXPECT_FALSE(says(announcement.end()));
  EXPECT_FALSE(says_goodbye({}));
}

}  // namespace
}  // namespace gatefield::dds
