#include "common/dds/packet_check.h"

#include <gtest/gtest.h>

#include <functional>
#include <set>
#include <string>
#include <vector>

#include "common/base/random.h"
#include "common/dds/endpoint.h"
#include "tests/support/rtps_corpus.h"
#include "tests/support/rtps_packet.h"
#include "tests/support/rtps_walk.h"

namespace gatefield::dds {
namespace {

using test::RtpsPacket;
using Fault = PacketFault;

constexpr int kData = 0x15, kDataFrag = 0x16, kHeartbeat = 0x07, kGap = 0x08, kAckNack = 0x06, kNackFrag = 0x12,
              kHeartbeatFrag = 0x13, kInfoTimestamp = 0x09, kInfoDestination = 0x0e, kInfoSource = 0x0c;
constexpr std::uint32_t kReader = 0x04000000, kWriter = 0x03000000;
constexpr std::uint32_t kDiscoveryWriter = 0xc2000100;  // of participants, as a little endian number

Fault fault_of(const RtpsPacket& packet) { return check_packet(packet.bytes()).fault; }

RtpsPacket data(std::int64_t sequence, int flags = 4, unsigned to_qos = 16, std::uint32_t writer = kWriter) {
  RtpsPacket packet;
  packet.begin(kData, flags).u16(0).u16(to_qos).u32(kReader).u32(writer).sequence(sequence);
  return packet;
}
RtpsPacket heartbeat(std::int64_t first, std::int64_t last) {
  return RtpsPacket().begin(kHeartbeat).u32(kReader).u32(kWriter).sequence(first).sequence(last).u32(1).end();
}
RtpsPacket gap(std::int64_t first, std::int64_t base, std::uint32_t bits = 0, std::size_t words = 0) {
  return RtpsPacket()
      .begin(kGap)
      .u32(kReader)
      .u32(kWriter)
      .sequence(first)
      .sequence(base)
      .u32(bits)
      .zeros(4 * words)
      .end();
}
RtpsPacket acknack(std::int64_t base, std::uint32_t bits, std::size_t words) {
  return RtpsPacket().begin(kAckNack).u32(kReader).u32(kWriter).sequence(base).u32(bits).zeros(4 * words).u32(1).end();
}
RtpsPacket fragments(std::uint32_t first, unsigned count, unsigned size, std::uint32_t sample, std::size_t payload) {
  return RtpsPacket()
      .begin(kDataFrag)
      .u16(0)
      .u16(28)
      .u32(kReader)
      .u32(kWriter)
      .sequence(7)
      .u32(first)
      .u16(count)
      .u16(size)
      .u32(sample)
      .zeros(payload)
      .end();
}

TEST(PacketCheck, ThePacketThatEndsTheLibraryIsDropped) {
  ASSERT_EQ(test::deadly_packet().size(), 88u);
  const PacketVerdict verdict = check_packet(test::deadly_packet());
  EXPECT_EQ(verdict.fault, Fault::kVendor);
  EXPECT_EQ(verdict.submessage, 0x80);
}

TEST(PacketCheck, StatisticsAtTheEndAreCutOff) {
  RtpsPacket packet = heartbeat(1, 4);
  const std::size_t without = packet.bytes().size();
  packet.begin(0x80).zeros(56).end();
  const PacketVerdict verdict = check_packet(packet.bytes());
  EXPECT_EQ(verdict.fault, Fault::kNone);
  EXPECT_EQ(verdict.size, without) << "the library never reads them";
  packet.begin(0x80).zeros(56).end();
  EXPECT_EQ(fault_of(packet), Fault::kVendor) << "twice";
  EXPECT_EQ(fault_of(heartbeat(1, 4).begin(0x80).zeros(52).end()), Fault::kVendor) << "of another length";
}

TEST(PacketCheck, OtherVendorsMayHaveTheirOwn) {
  const RtpsPacket packet = RtpsPacket({0x01, 0x10}).begin(0x80).zeros(12).end();
  EXPECT_EQ(fault_of(packet), Fault::kNone);
  EXPECT_EQ(check_packet(packet.bytes()).size, packet.bytes().size());
}

struct Case {
  std::string name;
  RtpsPacket packet;
  Fault expected;
};

class Packets : public ::testing::TestWithParam<Case> {};

TEST_P(Packets, IsJudged) {
  EXPECT_EQ(fault_of(GetParam().packet), GetParam().expected);
  // Cut off anywhere, no packet is read beyond its end (the sanitizer watches).
  const std::vector<std::uint8_t> whole = GetParam().packet.bytes();
  for (std::size_t size = 0; size < whole.size(); ++size) {
    const std::vector<std::uint8_t> part(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size));
    EXPECT_LE(check_packet(part).size, size);
  }
}

INSTANTIATE_TEST_SUITE_P(
    All, Packets,
    ::testing::Values(
        Case{"Empty", RtpsPacket(), Fault::kNone}, Case{"Data", data(1).zeros(8).end(), Fault::kNone},
        Case{"DataOfDisposal", data(1, 10).u16(0x71).u16(4).u8({0, 0, 0, 3}).u16(1).u16(0).zeros(20).end(),
             Fault::kNone},
        Case{"DataWithInlineQos", data(1, 6).u16(0x70).u16(16).zeros(16).u16(1).u16(0).zeros(8).end(), Fault::kNone},
        Case{"DataWithoutPayload", data(1).end(), Fault::kTooShort},
        Case{"DataOfSequenceZero", data(0).zeros(8).end(), Fault::kSequence},
        Case{"DataOfNegativeSequence", data(-1).zeros(8).end(), Fault::kSequence},
        Case{"DataFarAhead", data(kMaxSequence + 1).zeros(8).end(), Fault::kSequence},
        Case{"DataAndKey", data(1, 12).zeros(8).end(), Fault::kFlags},
        Case{"QosBeforeItsFields", data(1, 4, 8).zeros(8).end(), Fault::kTooShort},
        Case{"QosBeyondTheEnd", data(1, 4, 0x7fff).zeros(8).end(), Fault::kTooShort},
        Case{"QosWithoutEnd", data(1, 6).u16(0x70).u16(16).zeros(16).end(), Fault::kParameters},
        Case{"QosOfTooLongAParameter", data(1, 6).u16(0x70).u16(0xfff0).zeros(16).end(), Fault::kParameters},
        Case{"QosOfAnOddParameter", data(1, 6).u16(0x70).u16(3).zeros(4).u16(1).u16(0).end(), Fault::kParameters},
        Case{"Discovery",
             data(1, 4, 16, kDiscoveryWriter).u8({0, 3, 0, 0}).u16(0x15).u16(4).zeros(4).u16(1).u16(0).end(),
             Fault::kNone},
        Case{"DiscoveryWithoutEnd", data(1, 4, 16, kDiscoveryWriter).u8({0, 3, 0, 0}).u16(0x15).u16(4).zeros(4).end(),
             Fault::kParameters},
        Case{"DiscoveryBeyondTheEnd",
             data(1, 4, 16, kDiscoveryWriter).u8({0, 3, 0, 0}).u16(0x15).u16(0x100).zeros(4).u16(1).u16(0).end(),
             Fault::kParameters},
        Case{"Heartbeat", heartbeat(3, 9), Fault::kNone}, Case{"HeartbeatOfNothing", heartbeat(4, 3), Fault::kNone},
        Case{"HeartbeatTurnedRound", heartbeat(9, 3), Fault::kRange},
        Case{"HeartbeatOfZero", heartbeat(0, 3), Fault::kSequence},
        Case{"HeartbeatTooWide", heartbeat(1, kMaxHeartbeatSpan + 2), Fault::kRange},
        Case{"HeartbeatFarAhead", heartbeat(1, kMaxSequence + 1), Fault::kSequence},
        Case{"ShortHeartbeat", RtpsPacket().begin(kHeartbeat).zeros(24).end(), Fault::kTooShort},
        Case{"Gap", gap(3, 9, 33, 2), Fault::kNone}, Case{"GapTooWide", gap(1, kMaxGap + 2), Fault::kRange},
        Case{"GapTurnedRound", gap(9, 3), Fault::kRange}, Case{"GapOfZero", gap(0, 3), Fault::kSequence},
        Case{"GapOfTooManyBits", gap(1, 2, 257, 9), Fault::kRange},
        Case{"GapWithoutItsWords", gap(1, 2, 256, 2), Fault::kTooShort},
        Case{"AckNack", acknack(5, 40, 2), Fault::kNone}, Case{"FirstAckNack", acknack(0, 0, 0), Fault::kNone},
        Case{"AckNackOfTooManyBits", acknack(1, 0xffffffff, 8), Fault::kRange},
        Case{"AckNackWithoutItsWords", acknack(1, 256, 3), Fault::kTooShort},
        Case{"AckNackOfNegativeBase", acknack(-5, 0, 0), Fault::kSequence},
        Case{"Fragments", fragments(3, 2, 100, 450, 200), Fault::kNone},
        Case{"TheLastFragment", fragments(5, 1, 100, 450, 52), Fault::kNone},
        Case{"FragmentZero", fragments(0, 1, 100, 450, 100), Fault::kFragment},
        Case{"FragmentsOfNoSize", fragments(1, 1, 0, 450, 100), Fault::kFragment},
        Case{"NoFragments", fragments(1, 0, 100, 450, 0), Fault::kFragment},
        Case{"FragmentsBeyondTheSample", fragments(6, 1, 100, 450, 100), Fault::kFragment},
        Case{"FragmentsWithoutTheirBytes", fragments(1, 2, 100, 450, 100), Fault::kFragment},
        Case{"FragmentsWithMoreBytes", fragments(1, 1, 100, 450, 200), Fault::kFragment},
        Case{"ASampleTooLarge", fragments(1, 1, 100, kMaxSample_bytes + 1, 100), Fault::kFragment},
        Case{"NackFrag",
             RtpsPacket().begin(kNackFrag).u32(kReader).u32(kWriter).sequence(2).u32(1).u32(32).zeros(4).u32(1).end(),
             Fault::kNone},
        Case{"NackFragOfTooManyBits",
             RtpsPacket().begin(kNackFrag).u32(kReader).u32(kWriter).sequence(2).u32(1).u32(999).zeros(40).u32(1).end(),
             Fault::kRange},
        Case{"HeartbeatFrag",
             RtpsPacket().begin(kHeartbeatFrag).u32(kReader).u32(kWriter).sequence(2).u32(9).u32(1).end(),
             Fault::kNone},
        Case{"HeartbeatFragOfNothing",
             RtpsPacket().begin(kHeartbeatFrag).u32(kReader).u32(kWriter).sequence(2).u32(0).u32(1).end(),
             Fault::kRange},
        Case{"Timestamp", RtpsPacket().begin(kInfoTimestamp).zeros(8).end(), Fault::kNone},
        Case{"NoTimestamp", RtpsPacket().begin(kInfoTimestamp, 2).end(), Fault::kNone},
        Case{"TimestampWithoutOne", RtpsPacket().begin(kInfoTimestamp).end(), Fault::kTooShort},
        Case{"ShortDestination", RtpsPacket().begin(kInfoDestination).zeros(8).end(), Fault::kTooShort},
        Case{"ShortSource", RtpsPacket().begin(kInfoSource).zeros(12).end(), Fault::kTooShort},
        Case{"ItsOwnSource", RtpsPacket().begin(kInfoSource).zeros(8).u8({1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12}).end(),
             Fault::kNone},
        Case{"AnothersSource",
             RtpsPacket().begin(kInfoSource).zeros(8).u8({1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 13}).end(),
             Fault::kSource},
        Case{"QosThatAnswersForTheFilter", data(1, 6).u16(0x55).u16(4).zeros(4).u16(1).u16(0).zeros(8).end(),
             Fault::kFilter},
        Case{"AKeyThatDisposesOfNothing", data(1, 8).zeros(20).end(), Fault::kKey},
        Case{"ALengthBeyondTheEnd", RtpsPacket().u8({kHeartbeat, 1}).u16(40).zeros(28), Fault::kCut},
        Case{"HalfASubmessageHeader", RtpsPacket().u8({kHeartbeat, 1}), Fault::kCut},
        Case{"AnUnalignedNext", RtpsPacket().begin(0x01).zeros(3).end().begin(0x01).zeros(4).end(), Fault::kCut},
        Case{"UnknownKind", RtpsPacket().begin(0x20).zeros(12).end(), Fault::kNone}),
    [](const auto& packet) { return packet.param.name; });

TEST(PacketCheck, WhatIsNoRtpsIsDropped) {
  EXPECT_EQ(check_packet({}).fault, Fault::kHeader);
  std::vector<std::uint8_t> bytes = heartbeat(1, 2).bytes();
  bytes[0] = 'X';
  EXPECT_EQ(check_packet(bytes).fault, Fault::kHeader);
  bytes = heartbeat(1, 2).bytes();
  bytes[4] = 3;
  EXPECT_EQ(check_packet(bytes).fault, Fault::kHeader) << "another major version";
}

TEST(PacketCheck, DropsAreToldWithSenderAndReason) {
  EXPECT_EQ(in_words({3, Fault::kRange, 8, "10.0.0.7:41234"}),
            "dropped 3 packets that no DDS participant sends, the last one from 10.0.0.7:41234, a range of sequence "
            "numbers is turned round or too wide (submessage 8); look at who sends there");
}

TEST(PacketCheck, BigEndianIsReadAsSuch) {
  RtpsPacket packet;
  packet.u8({kHeartbeat, 0, 0, 28}).u32(kReader).u32(kWriter).u8({0, 0, 0, 0, 0, 0, 0, 1}).u8({0, 0, 0, 0, 0, 0, 0, 9});
  packet.u8({0, 0, 0, 1});
  EXPECT_EQ(fault_of(packet), Fault::kNone);
}

std::vector<std::vector<std::uint8_t>> recorded() {
  return test::recorded_packets(GATEFIELD_SOURCE_DIR "/tests/data/rtps/recorded.hex");
}

/// What was recorded of our own traffic: discovery, states, depth in fragments, replies, and what repairs losses.
TEST(PacketCheck, WhatWeSendOurselvesPasses) {
  std::set<int> kinds;
  for (const std::vector<std::uint8_t>& packet : recorded()) {
    const PacketVerdict verdict = check_packet(packet);
    EXPECT_EQ(verdict.fault, Fault::kNone) << sentence(verdict.fault) << " in submessage " << int{verdict.submessage};
    EXPECT_EQ(test::RtpsWalk::complaint({packet.data(), verdict.size}), "");
    for (std::size_t at = 20; at + 4 <= packet.size(); at += 4u + packet[at + 2] + 256u * packet[at + 3])
      kinds.insert(packet[at]);
  }
  for (const int kind : {kData, kDataFrag, kHeartbeat, kAckNack, kNackFrag, kInfoTimestamp, kInfoDestination})
    EXPECT_TRUE(kinds.contains(kind)) << "none of kind " << kind << " was recorded";
}

TEST(PacketCheck, WhatIsSpoiledPassesOnlyWithinItsBounds) {
  std::vector<std::vector<std::uint8_t>> good = recorded();
  for (const RtpsPacket& packet :
       {data(1, 6).u16(0x70).u16(16).zeros(16).u16(1).u16(0).zeros(8).end(), fragments(3, 2, 100, 450, 200),
        gap(3, 9, 33, 2), acknack(5, 40, 2), heartbeat(3, 9).begin(0x80).zeros(56).end()})
    good.push_back(packet.bytes());
  Random random(11);
  const auto draw = [&](std::size_t count) { return std::size_t{random.below(static_cast<std::uint32_t>(count))}; };
  for (int i = 0; i < 200'000; ++i) {
    std::vector<std::uint8_t> bytes = good[draw(good.size())];
    for (std::size_t k = 0, spoiled = 1 + draw(4); k < spoiled; ++k)
      bytes[draw(bytes.size())] = static_cast<std::uint8_t>(draw(256));
    if (draw(4) == 0) bytes.resize(draw(bytes.size() + 1));
    bytes.shrink_to_fit();
    const PacketVerdict verdict = check_packet(bytes);
    ASSERT_LE(verdict.size, bytes.size());
    ASSERT_NE(sentence(verdict.fault), "");
    if (verdict.fault == Fault::kNone) {
      ASSERT_EQ(test::RtpsWalk::complaint({bytes.data(), verdict.size}), "") << "packet " << i;
    }
  }
}

}  // namespace
}  // namespace gatefield::dds
