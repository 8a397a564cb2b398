#include "client/firmware/msp/frame.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

#include "tests/support/allocation_trap.h"

namespace gatefield::firmware::msp {
namespace {

using testing::ElementsAre;

using Bytes = std::vector<std::uint8_t>;

Bytes encoded(std::uint16_t command, const Bytes& payload, Version version = Version::k2, Way way = Way::kAnswer) {
  std::array<std::uint8_t, kMaxFrame> buffer{};
  const auto bytes = encode({way, version, command, payload}, buffer);
  return {bytes.begin(), bytes.end()};
}

void append(Bytes* to, const Bytes& more) { to->insert(to->end(), more.begin(), more.end()); }

struct Heard {
  std::uint16_t command;
  Bytes payload;
  friend bool operator==(const Heard&, const Heard&) = default;
};

/// Everything that a reader finds when the bytes come in pieces of `piece`.
std::vector<Heard> heard(FrameReader& reader, const Bytes& bytes, std::size_t piece = 64) {
  std::vector<Heard> found;
  for (std::size_t at = 0; at < bytes.size();) {
    const auto room = reader.room();
    EXPECT_FALSE(room.empty());
    const std::size_t count = std::min({piece, room.size(), bytes.size() - at});
    std::copy_n(bytes.begin() + static_cast<std::ptrdiff_t>(at), count, room.begin());
    reader.filled(count);
    at += count;
    while (const auto frame = reader.next())
      found.push_back({frame->command, Bytes(frame->payload.begin(), frame->payload.end())});
  }
  return found;
}
std::vector<Heard> heard(const Bytes& bytes, std::size_t piece = 64) {
  FrameReader reader;
  return heard(reader, bytes, piece);
}

TEST(MspFrame, IsThatOfTheProtocol) {
  // the question for the API's version, in both versions; sums worked out by hand
  EXPECT_THAT(encoded(1, {}, Version::k1, Way::kQuestion), ElementsAre('$', 'M', '<', 0, 1, 1));
  // command 100, no payload: the example of the protocol's description ($X<\0 d\0 \0\0 \x8f)
  EXPECT_THAT(encoded(100, {}, Version::k2, Way::kQuestion), ElementsAre('$', 'X', '<', 0, 100, 0, 0, 0, 0x8F));
  EXPECT_THAT(encoded(0x1234, {7}, Version::k2, Way::kQuestion),
              ElementsAre('$', 'X', '<', 0, 0x34, 0x12, 1, 0, 7, crc8_dvb_s2(0, Bytes{0, 0x34, 0x12, 1, 0, 7})));
}

TEST(MspFrame, TheSumIsTheOneOfItsName) {
  const std::string check = "123456789";  // the usual check value of CRC-8/DVB-S2
  EXPECT_EQ(crc8_dvb_s2(0, Bytes(check.begin(), check.end())), 0xBC);
}

TEST(MspFrame, IsReadBackWhereverItIsCut) {
  for (const Version version : {Version::k1, Version::k2}) {
    for (const std::size_t size : {0u, 1u, 6u, 253u, 254u}) {
      Bytes payload(size);
      for (std::size_t i = 0; i < size; ++i) payload[i] = static_cast<std::uint8_t>(i * 7);
      Bytes stream = encoded(101, payload, version);
      append(&stream, encoded(102, payload, version));
      for (const std::size_t piece : {1u, 2u, 3u, 5u, 64u, 1000u})
        EXPECT_THAT(heard(stream, piece), ElementsAre(Heard{101, payload}, Heard{102, payload}))
            << size << " " << piece;
    }
  }
}

TEST(MspFrame, LongAnswersOfVersionOneAreReadOrLeftOut) {
  const Bytes payload(254, '$');
  Bytes stream{'$', 'M', '>', 255, 99, 254, 0};
  append(&stream, payload);
  std::uint8_t sum = 0;
  for (std::size_t i = 3; i < stream.size(); ++i) sum ^= stream[i];
  stream.push_back(sum);
  EXPECT_THAT(heard(stream), ElementsAre(Heard{99, payload}));

  Bytes too_long{'$', 'M', '>', 255, 99, 0, 4};
  append(&too_long, Bytes(1025, 1));
  append(&too_long, encoded(7, {1}));
  EXPECT_THAT(heard(too_long), ElementsAre(Heard{7, {1}}));
}

TEST(MspFrame, ARefusalIsTold) {
  FrameReader reader;
  const Bytes bytes = encoded(200, {}, Version::k2, Way::kRefusal);
  std::copy(bytes.begin(), bytes.end(), reader.room().begin());
  reader.filled(bytes.size());
  const auto frame = reader.next();
  ASSERT_TRUE(frame.has_value());
  EXPECT_EQ(frame->way, Way::kRefusal);
}

TEST(MspFrame, AnyChangedByteLosesItsFrameAndNoOther) {
  const Bytes payload{10, 20, 30, 40, 50, 60};
  for (const Version version : {Version::k1, Version::k2}) {
    const Bytes one = encoded(108, payload, version);
    for (std::size_t at = 0; at < one.size(); ++at) {
      for (const int bit : {0, 3, 7}) {
        Bytes stream = one;
        stream[at] ^= static_cast<std::uint8_t>(1 << bit);
        for (int i = 0; i < 40; ++i) append(&stream, one);  // what a broken size waits for
        const auto found = heard(stream);
        const auto good = std::count(found.begin(), found.end(), Heard{108, payload});
        EXPECT_GE(good, 40) << at;
        // version 1 says nothing about the direction's letter in its sum, so a '<' that became another may be heard
        EXPECT_LE(static_cast<long>(found.size()), 41) << at;
      }
    }
  }
}

TEST(MspFrame, CutFramesCostNoneThatFollow) {
  const Bytes payload{1, 2, 3, 4, 5, 6, 7, 8};
  const Bytes one = encoded(101, payload);
  for (std::size_t kept = 0; kept < one.size(); ++kept) {
    Bytes stream(one.begin(), one.begin() + static_cast<std::ptrdiff_t>(kept));
    for (int i = 0; i < 3; ++i) append(&stream, one);
    append(&stream, Bytes(kMaxFrame, 0));  // what a cut size may wait for
    EXPECT_THAT(heard(stream), ElementsAre(Heard{101, payload}, Heard{101, payload}, Heard{101, payload})) << kept;
  }
}

TEST(MspFrame, ANoisyLineGivesWhatCameThroughAndNothingElse) {
  std::mt19937 random(7);
  std::uniform_int_distribution<int> byte(0, 255);
  std::uniform_int_distribution<int> length(0, 40);
  FrameReader reader;
  int sent = 0, found = 0, false_ones = 0;
  for (int round = 0; round < 3000; ++round) {
    Bytes stream;
    for (int i = length(random); i > 0; --i) stream.push_back(static_cast<std::uint8_t>(byte(random)));
    const Bytes payload{static_cast<std::uint8_t>(round), static_cast<std::uint8_t>(round >> 8), 9, 9, 9, 9};
    append(&stream, encoded(108, payload));
    ++sent;
    for (const Heard& frame : heard(reader, stream, 17)) {
      const bool ours = frame.command == 108 && frame.payload.size() == 6 && frame.payload[2] == 9;
      ++(ours ? found : false_ones);
    }
  }
  EXPECT_GE(found, sent - 5) << "only the last ones may still wait for bytes";
  EXPECT_EQ(false_ones, 0);
  EXPECT_GT(reader.skipped(), 30000u);
}

TEST(MspFrame, NothingButNoiseFindsAnEndAndKeepsItsRoom) {
  std::mt19937 random(1);
  std::uniform_int_distribution<int> letter(0, 5);
  const std::array<std::uint8_t, 6> likely{'$', 'M', 'X', '<', '>', 255};  // the worst noise there is
  Bytes stream(200000);
  for (auto& byte : stream) byte = likely[static_cast<std::size_t>(letter(random))];
  FrameReader reader;
  heard(reader, stream, 4096);
  EXPECT_GT(reader.skipped(), 190000u);
}

TEST(MspFrame, ReadingAndWritingAllocatesNothing) {
  FrameReader reader;
  std::array<std::uint8_t, kMaxFrame> buffer{};
  const std::array<std::uint8_t, 3> payload{1, 2, 3};
  const test::AllocationTrap trap;
  const auto bytes = encode({Way::kAnswer, Version::k2, 5, payload}, buffer);
  std::copy(bytes.begin(), bytes.end(), reader.room().begin());
  reader.filled(bytes.size());
  const bool found = reader.next().has_value();
  EXPECT_EQ(trap.count(), 0u);
  EXPECT_TRUE(found);
}

}  // namespace
}  // namespace gatefield::firmware::msp
