#include "client/firmware/mavlink/frame_reader.h"

#include <gtest/gtest.h>

#include <vector>

#include "tests/support/allocation_trap.h"
#include "tests/support/mavlink_words.h"

namespace gatefield::firmware::mavlink {
namespace {

using Bytes = std::vector<std::uint8_t>;

void append(Bytes* to, std::span<const std::uint8_t> bytes) { to->insert(to->end(), bytes.begin(), bytes.end()); }

Bytes heartbeat(std::uint8_t sequence = 0, Address from = {1, 1}) {
  Heartbeat message;
  message.custom_mode = 0x01020304;
  message.type = 2;
  const auto packet = pack(message, from, sequence);
  return {packet.bytes().begin(), packet.bytes().end()};
}

/// A whole frame of a message that is not known here; nobody can tell whether its checksum is right.
Bytes unknown(std::uint8_t sequence = 0) { return {0xFD, 3, 0, 0, sequence, 1, 1, 74, 0, 0, 0xFD, 1, 2, 0xAA, 0xBB}; }

class Stream {
 public:
  void read(std::span<const std::uint8_t> bytes, bool whole_packet = false) {
    reader_.read(bytes, whole_packet, [this](const Frame& frame) { frames.push_back(frame); });
  }
  const ReaderCounts& counts() const { return reader_.counts(); }
  std::vector<Frame> frames;

 private:
  FrameReader reader_;
};

TEST(FrameReader, FindsFramesHoweverTheStreamIsCut) {
  Random random(1, gatefield::Stream("test.mavlink.cut"));
  Bytes bytes;
  std::vector<std::string> sent;
  for (std::size_t i = 0; i < 200; ++i) {
    const Message message = test::drawn_message(i % definitions().size(), &random);
    sent.push_back(test::words_of(message));
    append(&bytes, pack(message, {1, 1}, static_cast<std::uint8_t>(i)).bytes());
  }
  for (const std::size_t piece : {1, 2, 7, 64, 279, 100000}) {
    Stream stream;
    for (std::size_t at = 0; at < bytes.size(); at += piece)
      stream.read(std::span(bytes).subspan(at, std::min(piece, bytes.size() - at)));
    ASSERT_EQ(stream.frames.size(), sent.size()) << piece;
    for (std::size_t i = 0; i < sent.size(); ++i) EXPECT_EQ(test::words_of(unpack(stream.frames[i]).value()), sent[i]);
    EXPECT_EQ(stream.counts().lost, 0U);
    EXPECT_EQ(stream.counts().noise_bytes, 0U);
  }
}

TEST(FrameReader, GoesOnBehindABrokenFrame) {
  for (std::size_t broken = 0; broken < heartbeat().size(); ++broken) {
    Bytes bytes = heartbeat(0);
    bytes[broken] ^= 0x40;
    for (std::uint8_t i = 1; i < 30; ++i) append(&bytes, heartbeat(i));
    Stream stream;
    stream.read(bytes);
    ASSERT_GE(stream.frames.size(), 28U) << "byte " << broken;
    EXPECT_EQ(stream.frames.back().sequence, 29);
  }
}

TEST(FrameReader, GoesOnBehindACutFrame) {
  for (std::size_t length = 1; length < heartbeat().size(); ++length) {
    Bytes bytes = heartbeat(0);
    bytes.resize(length);
    for (std::uint8_t i = 1; i < 30; ++i) append(&bytes, heartbeat(i));
    Stream stream;
    stream.read(bytes);
    EXPECT_EQ(stream.frames.size(), 29U) << length << " bytes";
  }
}

TEST(FrameReader, FindsEveryFrameBetweenGarbage) {
  Random random(2, gatefield::Stream("test.mavlink.garbage"));
  Bytes bytes;
  for (int i = 0; i < 200; ++i) {
    for (auto noise = random.bits() % 100; noise > 0; --noise)
      bytes.push_back(static_cast<std::uint8_t>(random.bits()));
    append(&bytes, heartbeat(static_cast<std::uint8_t>(i)));
  }
  bytes.resize(bytes.size() + kLongestFrame);  // so that no false marker still waits
  Stream stream;
  stream.read(bytes);
  EXPECT_EQ(stream.frames.size(), 200U);
  EXPECT_GT(stream.counts().noise_bytes, 5000U);
}

TEST(FrameReader, IsNotHeldUpByAFalseMarker) {
  Stream stream;
  stream.read(Bytes{0xFD, 255, 0, 0, 0, 0, 0, 0, 0, 0});  // promises 255 bytes that never come
  for (std::uint8_t i = 0; i < 20; ++i) {
    stream.read(heartbeat(i));
    EXPECT_EQ(stream.frames.size(), i + 1U);
  }
}

TEST(FrameReader, DoesNotWaitBehindTheEndOfADatagram) {
  Bytes bytes{0xFD, 255, 0, 0, 0, 0, 0, 0, 0, 0};
  append(&bytes, heartbeat(1));
  Stream stream;
  stream.read(bytes, true);
  EXPECT_EQ(stream.frames.size(), 1U);
  Bytes cut = heartbeat(2);
  cut.pop_back();
  stream.read(cut, true);
  stream.read(heartbeat(3), true);
  ASSERT_EQ(stream.frames.size(), 2U);
  EXPECT_EQ(stream.frames[1].sequence, 3);
}

TEST(FrameReader, StepsOverUnknownMessages) {
  Bytes bytes = heartbeat(0);
  append(&bytes, unknown(1));
  append(&bytes, unknown(2));
  append(&bytes, heartbeat(3));
  for (const bool packet : {true, false}) {
    Stream stream;
    stream.read(bytes, packet);
    EXPECT_EQ(stream.frames.size(), 2U);
    EXPECT_EQ(stream.counts().unknown, 2U);
    EXPECT_EQ(stream.counts().lost, 0U) << "unknown frames are not lost";
    EXPECT_EQ(stream.counts().noise_bytes, 0U);
  }
  Stream stream;
  stream.read(unknown(), true);
  EXPECT_EQ(stream.counts().unknown, 1U) << "the last of a datagram";
}

TEST(FrameReader, CountsLostFramesOfEachSenderByItself) {
  Stream stream;
  for (std::uint8_t i = 0; i < 20; ++i) {
    stream.read(heartbeat(i, {1, 1}));
    stream.read(heartbeat(static_cast<std::uint8_t>(2 * i), {2, 1}));
  }
  EXPECT_EQ(stream.counts().lost, 19U);
}

TEST(FrameReader, CountsLostFramesAcrossTheTurnOfTheSequence) {
  Stream stream;
  for (const int sequence : {250, 251, 255, 0, 3}) stream.read(heartbeat(static_cast<std::uint8_t>(sequence)));
  EXPECT_EQ(stream.counts().lost, 5U);
}

TEST(FrameReader, ReadsSignedFramesAndCountsThem) {
  Bytes bytes{0xFD, 1, 1, 0, 0, 1, 1, 0, 0, 0, 7};
  Checksum checksum;
  checksum.add(std::span(bytes).subspan(1));
  checksum.add(std::uint8_t{50});
  bytes.push_back(static_cast<std::uint8_t>(checksum.value()));
  bytes.push_back(static_cast<std::uint8_t>(checksum.value() >> 8));
  bytes.resize(bytes.size() + 13, 0xFD);  // a signature full of markers
  append(&bytes, heartbeat(1));
  Stream stream;
  stream.read(bytes);
  ASSERT_EQ(stream.frames.size(), 2U);
  EXPECT_TRUE(stream.frames[0].is_signed);
  EXPECT_FALSE(stream.frames[1].is_signed);
  EXPECT_EQ(stream.counts().signed_frames, 1U);
  EXPECT_EQ(stream.counts().noise_bytes, 0U);
}

TEST(FrameReader, DropsFramesWithFlagsOfTheFuture) {
  Bytes bytes{0xFD, 1, 2, 0, 0, 1, 1, 0, 0, 0, 7, 0, 0};
  append(&bytes, heartbeat(1));
  Stream stream;
  stream.read(bytes);
  EXPECT_EQ(stream.frames.size(), 1U);
  EXPECT_EQ(stream.counts().incompatible, 1U);
}

TEST(FrameReader, DropsFramesOfAnotherDefinition) {
  Bytes bytes = heartbeat();
  bytes[7] = 2;  // what was a heartbeat says that it is the time
  append(&bytes, heartbeat(1));
  Stream stream;
  stream.read(bytes);
  EXPECT_EQ(stream.frames.size(), 1U);
  EXPECT_EQ(stream.counts().bad_checksums, 1U);
}

TEST(FrameReader, AllocatesNothing) {
  Bytes bytes = heartbeat();
  append(&bytes, unknown());
  append(&bytes, pack(Odometry{}, {1, 1}, 1).bytes());
  FrameReader reader;
  int frames = 0;
  const test::AllocationTrap trap;
  reader.read(bytes, true, [&](const Frame& frame) {
    const auto message = unpack(frame);
    if (message && validate(*message)) frames += pack(*message, frame.from, 0).bytes().empty() ? 0 : 1;
  });
  const std::size_t allocations = trap.count();
  EXPECT_EQ(allocations, 0U);
  EXPECT_EQ(frames, 2);
}

}  // namespace
}  // namespace gatefield::firmware::mavlink
