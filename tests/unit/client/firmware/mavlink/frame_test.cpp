#include "client/firmware/mavlink/frame.h"

#include <gtest/gtest.h>

#include <fstream>
#include <vector>

#include "client/firmware/mavlink/frame_reader.h"
#include "tests/support/mavlink_words.h"

namespace gatefield::firmware::mavlink {
namespace {

using test::hex;
using test::unhex;
using test::words_of;

struct Golden {
  std::string words, version2, version2_signed, version1;  // the last is empty for kinds with extensions
};

/// What someone else's implementation wrote (tests/conformance/mavlink/peer.js).
std::vector<Golden> golden() {
  std::ifstream file(std::string(GATEFIELD_SOURCE_DIR) + "/tests/data/mavlink/frames.txt");
  std::vector<Golden> lines;
  for (std::string line; std::getline(file, line);) {
    std::vector<std::string> parts;
    std::size_t begin = 0;
    for (std::size_t bar = 0; (bar = line.find(" | ", begin)) != std::string::npos; begin = bar + 3)
      parts.push_back(line.substr(begin, bar - begin));
    parts.push_back(line.substr(begin));
    EXPECT_EQ(parts.size(), 4U) << line;
    lines.push_back({parts[0], parts[1], parts[2], parts[3]});
  }
  return lines;
}

std::vector<Frame> frames_in(std::span<const std::uint8_t> bytes) {
  FrameReader reader;
  std::vector<Frame> frames;
  reader.read(bytes, true, [&](const Frame& frame) { frames.push_back(frame); });
  return frames;
}

Message only_message_in(const std::string& digits) {
  const auto frames = frames_in(unhex(digits));
  EXPECT_EQ(frames.size(), 1U) << digits;
  const auto message = frames.empty() ? std::nullopt : unpack(frames[0]);
  EXPECT_TRUE(message) << digits;
  return message.value_or(Heartbeat{});
}

TEST(Frame, IsReadAsSomeoneElseWroteIt) {
  const auto lines = golden();
  ASSERT_EQ(lines.size(), 2 * definitions().size());
  for (const Golden& line : lines) {
    EXPECT_EQ(words_of(only_message_in(line.version2)), line.words);
    EXPECT_EQ(words_of(only_message_in(line.version2_signed)), line.words);
    if (!line.version1.empty()) {
      EXPECT_EQ(words_of(only_message_in(line.version1)), line.words);
    }
  }
}

TEST(Frame, IsWrittenAsSomeoneElseWritesIt) {
  for (const Golden& line : golden()) {
    const auto bytes = unhex(line.version2);
    const auto frame = frames_in(bytes).at(0);
    const auto message = unpack(frame);
    ASSERT_TRUE(message);
    EXPECT_EQ(hex(pack(*message, frame.from, frame.sequence).bytes()), line.version2);
    if (!line.version1.empty()) {
      EXPECT_EQ(hex(pack(*message, frame.from, frame.sequence, 1).bytes()), line.version1);
    }
  }
}

TEST(Frame, SaysWhoSentItAndWhich) {
  const auto frame = frames_in(pack(Odometry{}, {7, 191}, 200).bytes()).at(0);
  EXPECT_EQ(frame.version, 2);
  EXPECT_EQ(frame.from, (Address{7, 191}));
  EXPECT_EQ(frame.sequence, 200);
  EXPECT_EQ(frame.id, 331U);
  EXPECT_FALSE(frame.is_signed);
}

TEST(Frame, GivesBackWhatWasPacked) {
  Random random(1, Stream("test.mavlink.there_and_back"));
  for (std::size_t kind = 0; kind < definitions().size(); ++kind) {
    for (int i = 0; i < 50; ++i) {
      const Message message = test::drawn_message(kind, &random);
      const auto frames = frames_in(pack(message, {1, 1}, 0).bytes());
      ASSERT_EQ(frames.size(), 1U);
      EXPECT_EQ(words_of(unpack(frames[0]).value()), words_of(message));
    }
  }
}

TEST(Frame, LeavesOutZerosAtTheEndButForTheFirstByte) {
  Timesync message;
  message.ts1 = 1;  // the ninth byte of eighteen
  EXPECT_EQ(pack(message, {1, 1}, 0).bytes().size(), 10U + 9U + 2U);
  message.ts1 = 0;
  EXPECT_EQ(pack(message, {1, 1}, 0).bytes().size(), 10U + 1U + 2U);
  EXPECT_EQ(words_of(unpack(frames_in(pack(message, {1, 1}, 0).bytes()).at(0)).value()), words_of(message));
}

TEST(Frame, OfVersion1HasNoExtensions) {
  CommandAck message;
  message.command = 400;
  message.result_param2 = 5;
  const auto packet = pack(message, {1, 1}, 0, 1);
  EXPECT_EQ(packet.bytes().size(), 6U + 3U + 2U);
  const auto back = std::get<CommandAck>(unpack(frames_in(packet.bytes()).at(0)).value());
  EXPECT_EQ(back.command, 400);
  EXPECT_EQ(back.result_param2, 0);
}

TEST(Frame, WithMoreFieldsThanAreKnownIsReadAsFarAsTheyAre) {
  // A heartbeat with three bytes more, as a later definition might have; its checksum made by hand.
  std::vector<std::uint8_t> bytes{0xFD, 12, 0, 0, 5, 1, 1, 0, 0, 0, 1, 0, 0, 0, 2, 12, 0, 3, 3, 9, 9, 9};
  Checksum checksum;
  checksum.add(std::span(bytes).subspan(1));
  checksum.add(std::uint8_t{50});
  bytes.push_back(static_cast<std::uint8_t>(checksum.value()));
  bytes.push_back(static_cast<std::uint8_t>(checksum.value() >> 8));
  const auto heartbeat = std::get<Heartbeat>(unpack(frames_in(bytes).at(0)).value());
  EXPECT_EQ(heartbeat.custom_mode, 1U);
  EXPECT_EQ(heartbeat.autopilot, 12);
  EXPECT_EQ(heartbeat.mavlink_version, 3);
}

TEST(Frame, OfAnUnknownMessageIsNone) {
  Frame frame;
  frame.id = 3;
  EXPECT_FALSE(unpack(frame));
}

}  // namespace
}  // namespace gatefield::firmware::mavlink
