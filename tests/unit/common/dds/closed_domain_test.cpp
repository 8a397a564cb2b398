#include "common/dds/closed_domain.h"

#include <gtest/gtest.h>

#include <functional>
#include <string>
#include <vector>

#include "common/dds/token_check.h"
#include "tests/support/rtps_packet.h"

namespace gatefield::dds {
namespace {

using namespace std::chrono_literals;
using test::RtpsPacket;
using Bytes = std::vector<std::uint8_t>;

// Writers, as little endian numbers: of participants, of handshakes, of publications in the open and of states.
constexpr std::uint32_t kParticipants = 0xc2000100, kHandshakes = 0xc3010200, kPublications = 0xc2030000,
                        kStates = 0x02010000;

RtpsPacket data(std::uint32_t writer, const Bytes& payload, int flags = 4) {
  RtpsPacket packet;
  packet.begin(0x15, flags).u16(0).u16(16).u32(0).u32(writer).sequence(1);
  for (const std::uint8_t byte : payload) packet.u8({byte});
  return packet.end();
}

/// @param key     0: one that two share  @param proofs  how many receivers it is proven to
RtpsPacket encrypted(std::uint32_t key, std::uint32_t proofs) {
  const auto high = static_cast<int>(proofs & 0xff);
  return RtpsPacket()
      .begin(0x31)
      .zeros(4)
      .u32(key)
      .zeros(12)
      .end()
      .begin(0x30)
      .u8({0, 0, 0, 8})
      .zeros(8)
      .end()
      .begin(0x32)
      .zeros(16)
      .u8({0, 0, 0, high})
      .zeros(20 * proofs)
      .end();
}

Bytes number(std::uint32_t value) {
  return {static_cast<std::uint8_t>(value), static_cast<std::uint8_t>(value >> 8),
          static_cast<std::uint8_t>(value >> 16), static_cast<std::uint8_t>(value >> 24)};
}
void append(Bytes* bytes, const Bytes& more) { bytes->insert(bytes->end(), more.begin(), more.end()); }
/// Text of a token, with its length and aligned.
Bytes words(const std::string& text) {
  Bytes bytes = number(static_cast<std::uint32_t>(text.size() + 1));
  bytes.insert(bytes.end(), text.begin(), text.end());
  bytes.resize((bytes.size() + 4) / 4 * 4);
  return bytes;
}
/// @param properties  how many it says it has; there is one
Bytes token(std::uint32_t properties = 1, std::uint32_t value_bytes = 100) {
  Bytes bytes = words("DDS:Auth:PKI-DH:1.0+Req");
  append(&bytes, number(properties));
  append(&bytes, words("dds.cert.sn"));
  append(&bytes, words("CN=A"));
  append(&bytes, number(1));
  append(&bytes, words("c.id"));
  append(&bytes, number(value_bytes));
  bytes.resize(bytes.size() + 100);
  return bytes;
}
Bytes handshake(const Bytes& of = token(), std::uint32_t tokens = 1) {
  Bytes bytes{0, 3, 0, 0};
  bytes.resize(bytes.size() + 96);
  append(&bytes, words("dds.sec.auth"));
  append(&bytes, number(tokens));
  append(&bytes, of);
  return bytes;
}
constexpr unsigned kFragment = 100;
RtpsPacket fragment(const Bytes& message, unsigned index, std::uint32_t writer = kHandshakes,
                    std::int64_t sequence = 1) {
  RtpsPacket packet;
  packet.begin(0x0e).zeros(12).end();
  packet.begin(0x16).u16(0).u16(28).u32(0xc4010200).u32(writer).sequence(sequence).u32(index + 1).u16(1).u16(kFragment);
  packet.u32(static_cast<std::uint32_t>(message.size()));
  for (std::size_t i = index * kFragment; i < std::min<std::size_t>(message.size(), (index + 1) * kFragment); ++i)
    packet.u8({message[i]});
  return packet.end();
}

/// An announcement of the participant that RtpsPacket speaks for.
Bytes announcement(std::uint8_t address, std::uint8_t participant = 1) {
  Bytes bytes{0, 3, 0, 0, 0x50, 0, 16, 0};
  for (int i = 0; i < 12; ++i) bytes.push_back(static_cast<std::uint8_t>(i == 0 ? participant : i + 1));
  append(&bytes, {0, 0, 1, 0xc1, 2, 0, 4, 0, address, 1, 1, 1, 1, 0, 0, 0});
  return bytes;
}

class ClosedDomainTest : public ::testing::Test {
 protected:
  ClosedDomain::Verdict check(const RtpsPacket& packet) {
    last_ = packet.bytes();
    EXPECT_EQ(check_packet(last_).fault, PacketFault::kNone) << "not what is tested here";
    return domain_.check(last_, now_);
  }
  PacketFault fault(const RtpsPacket& packet) { return check(packet).fault; }

  ClosedDomain domain_;
  Stamp now_ = 100s;
  Bytes last_;
};

TEST_F(ClosedDomainTest, WhatIsEncryptedForItsReceiverPasses) {
  EXPECT_EQ(fault(encrypted(7, 1)), PacketFault::kNone);
  EXPECT_EQ(fault(encrypted(7, 3)), PacketFault::kNone);
  EXPECT_EQ(fault(encrypted(0, 0)), PacketFault::kNone) << "the exchange of keys: two share its key";
}

TEST_F(ClosedDomainTest, WhatProvesNothingDoesNot) {
  EXPECT_EQ(fault(encrypted(7, 0)), PacketFault::kUnprotected);
  const auto prefix = [] { return std::move(RtpsPacket().begin(0x31).zeros(4).u32(7).zeros(12).end()); };
  EXPECT_EQ(fault(prefix()), PacketFault::kUnprotected) << "cut off";
  EXPECT_EQ(fault(prefix().begin(0x30).u8({0, 0, 0, 99}).zeros(8).end()), PacketFault::kUnprotected);
  EXPECT_EQ(fault(prefix().begin(0x15, 4).u16(0).u16(16).u32(0).u32(kStates).sequence(1).zeros(8).end()),
            PacketFault::kUnprotected)
      << "signed alone";
  EXPECT_EQ(fault(RtpsPacket().begin(0x32).zeros(20).end()), PacketFault::kUnprotected);
  EXPECT_EQ(fault(RtpsPacket().begin(0x33).zeros(20).end()), PacketFault::kUnprotected);
}

TEST_F(ClosedDomainTest, WhatIsSaidInTheOpenDoesNot) {
  EXPECT_EQ(fault(data(kStates, Bytes(16))), PacketFault::kUnprotected);
  Bytes nothing{0, 3, 0, 0, 1, 0, 0, 0};
  EXPECT_EQ(fault(data(kPublications, nothing)), PacketFault::kUnprotected) << "a writer, announced";
  const auto beat = [](std::uint32_t writer) {
    return std::move(RtpsPacket().begin(7).u32(0).u32(writer).sequence(1).sequence(9).u32(1).end());
  };
  EXPECT_EQ(fault(beat(kStates)), PacketFault::kUnprotected);
  EXPECT_EQ(fault(beat(kPublications)), PacketFault::kNone) << "nothing is said through it";
  EXPECT_EQ(fault(fragment(Bytes(250), 0, kStates)), PacketFault::kUnprotected);
}

TEST_F(ClosedDomainTest, AnAnnouncementStaysWhatItWas) {
  const Bytes first = announcement(10), other = announcement(99);
  EXPECT_EQ(fault(data(kParticipants, first)), PacketFault::kNone);
  EXPECT_EQ(fault(data(kParticipants, other)), PacketFault::kAnnouncement);
  EXPECT_EQ(fault(data(kParticipants, announcement(10, 77))), PacketFault::kAnnouncement) << "of another participant";
  for (int i = 0; i < 20; ++i) {
    now_ += 2s;
    EXPECT_EQ(fault(data(kParticipants, first)), PacketFault::kNone);
  }
  now_ += 6s;
  EXPECT_EQ(fault(data(kParticipants, other)), PacketFault::kNone) << "the one before is long gone";
}

TEST_F(ClosedDomainTest, NobodysGoodbyeIsTaken) {
  const Bytes key{0, 3, 0, 0, 0x50, 0, 16, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 0, 0, 1, 0xc1, 1, 0, 0, 0};
  RtpsPacket packet;
  packet.begin(0x15, 2 | 8).u16(0).u16(16).u32(0).u32(kParticipants).sequence(2);
  packet.u16(0x71).u16(4).u8({0, 0, 0, 3}).u16(1).u16(0);
  for (const std::uint8_t byte : key) packet.u8({byte});
  EXPECT_EQ(fault(packet.end()), PacketFault::kAnnouncement);
}

TEST_F(ClosedDomainTest, ManyWhoAnnounceThemselvesDisplaceNobody) {
  const Bytes first = announcement(10);
  EXPECT_EQ(fault(data(kParticipants, first)), PacketFault::kNone);
  const auto crowd = [&](int i) {
    Bytes packet = data(kParticipants, first).bytes();
    constexpr std::size_t kHeaders_bytes = 20 + 24, kName_at = 8;
    packet[8] = packet[kHeaders_bytes + kName_at] = static_cast<std::uint8_t>(100 + i % 100);
    packet[9] = packet[kHeaders_bytes + kName_at + 1] = static_cast<std::uint8_t>(i / 100);
    return domain_.check(packet, now_).fault;
  };
  int refused = 0;
  for (int i = 0; i < 3000; ++i) refused += crowd(i) != PacketFault::kNone ? 1 : 0;
  EXPECT_GT(refused, 1900);
  EXPECT_EQ(fault(data(kParticipants, first)), PacketFault::kNone);
}

TEST_F(ClosedDomainTest, AHandshakeThatLiesOfItsSizeIsDropped) {
  const auto whole = [](const Bytes& message) { return check_packet(data(kHandshakes, message).bytes()).fault; };
  EXPECT_EQ(fault(data(kHandshakes, handshake())), PacketFault::kNone);
  EXPECT_EQ(whole(handshake(token(0x10000000))), PacketFault::kToken);
  EXPECT_EQ(whole(handshake(token(1, 0xfffffff0))), PacketFault::kToken);
  EXPECT_EQ(whole(handshake(token(), 0x10000000)), PacketFault::kToken);
  EXPECT_EQ(fault(fragment(handshake(), 0)), PacketFault::kUnprotected) << "not whole, so that nobody has read it";
}

// With security or without, the library makes room for what a token says.
TEST(TokenCheck, ATokenThatLiesOfItsSizeIsDropped) {
  const auto announcement = [](const Bytes& of) {
    Bytes bytes{0, 3, 0, 0, 1, 0x10};
    const Bytes size = number(static_cast<std::uint32_t>(of.size()));
    bytes.insert(bytes.end(), size.begin(), size.begin() + 2);
    append(&bytes, of);
    append(&bytes, {1, 0, 0, 0});
    return bytes;
  };
  EXPECT_EQ(check_packet(data(kParticipants, announcement(token())).bytes()).fault, PacketFault::kNone);
  EXPECT_EQ(check_packet(data(kParticipants, announcement(token(0x10000000))).bytes()).fault, PacketFault::kToken);
  EXPECT_EQ(check_packet(data(kParticipants, announcement(token(1, 0xfffffff0))).bytes()).fault, PacketFault::kToken);
  EXPECT_FALSE(check_token(Bytes(3), true));
  EXPECT_FALSE(check_handshake(Bytes(50)));
}

}  // namespace
}  // namespace gatefield::dds
