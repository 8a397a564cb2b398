#include "client/firmware/link/link.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numeric>
#include <vector>

namespace gatefield::firmware {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::HasSubstr;

constexpr auto kSoon = 2s;  // longer than anything on this machine takes, and waited for only when a test fails

std::unique_ptr<Link> opened(const std::string& written) {
  const auto address = parse_address(written);
  EXPECT_TRUE(address.ok()) << address.error();
  auto link = open(*address, kSoon);
  EXPECT_TRUE(link.ok()) << link.error();
  return std::move(link).value();
}

Error refused(const std::string& written, std::chrono::nanoseconds timeout = kSoon) {
  auto link = open(*parse_address(written), timeout);
  EXPECT_FALSE(link.ok()) << written;
  return link.ok() ? Error("") : link.failure();
}

std::string here(const char* kind, std::uint16_t port) {
  return std::string(kind) + ":127.0.0.1:" + std::to_string(port);
}

/// All that comes until `count` bytes are there or nothing comes any more.
std::vector<std::uint8_t> receive(Link& link, std::size_t count) {
  std::vector<std::uint8_t> all;
  while (all.size() < count && link.wait(kSoon)) {
    std::array<std::uint8_t, 4096> buffer{};
    const Transfer got = link.receive(buffer);
    if (got.broken != 0) break;
    all.insert(all.end(), buffer.begin(), buffer.begin() + static_cast<std::ptrdiff_t>(got.bytes));
  }
  return all;
}

class LinkOverTcp : public testing::Test {
 protected:
  /// The listening side learns of a connection when it receives.
  void meet() {
    near = opened(here("tcp", far->local_port()));
    const std::array<std::uint8_t, 1> hello{7};
    ASSERT_EQ(near->send(hello).bytes, 1u);
    ASSERT_THAT(receive(*far, 1), ElementsAre(7));
  }

  std::unique_ptr<Link> far = opened("tcp-listen:127.0.0.1:0");
  std::unique_ptr<Link> near;
};

TEST_F(LinkOverTcp, CarriesBytesBothWays) {
  meet();
  const std::array<std::uint8_t, 3> there{1, 2, 3}, back{4, 5, 6};
  EXPECT_EQ(near->send(there).bytes, 3u);
  EXPECT_THAT(receive(*far, 3), ElementsAre(1, 2, 3));
  EXPECT_EQ(far->send(back).bytes, 3u);
  EXPECT_THAT(receive(*near, 3), ElementsAre(4, 5, 6));
}

TEST_F(LinkOverTcp, NothingThereIsNoFailureAndTakesNoTime) {
  std::array<std::uint8_t, 8> buffer{};
  EXPECT_EQ(far->receive(buffer).bytes, 0u);
  EXPECT_EQ(far->send(buffer).bytes, 0u) << "nobody has connected";
  meet();
  const auto begin = std::chrono::steady_clock::now();
  const Transfer nothing = near->receive(buffer);
  EXPECT_EQ(nothing.bytes, 0u);
  EXPECT_EQ(nothing.broken, 0);
  EXPECT_FALSE(near->wait(20ms));
  EXPECT_LT(std::chrono::steady_clock::now() - begin, 1s);
}

TEST_F(LinkOverTcp, MessagesAreTakenWholeOrNotAtAll) {
  meet();
  std::vector<std::uint8_t> message(1000);
  std::iota(message.begin(), message.end(), std::uint8_t{0});
  std::size_t taken = 0;
  while (near->send(message).bytes == message.size()) ++taken;  // until the system's buffers are full
  ASSERT_GT(taken, 10u);
  EXPECT_EQ(near->send(message).bytes, 0u) << "what is half sent comes first";
  std::vector<std::uint8_t> arrived;
  while (arrived.size() < taken * message.size()) {
    const auto more = receive(*far, 1);
    ASSERT_FALSE(more.empty());
    arrived.insert(arrived.end(), more.begin(), more.end());
    (void)near->send({});  // room again: the rest goes out
  }
  ASSERT_EQ(arrived.size(), taken * message.size());
  for (std::size_t i = 0; i < arrived.size(); ++i) ASSERT_EQ(arrived[i], message[i % message.size()]) << i;
}

TEST_F(LinkOverTcp, TheOtherSidesEndIsTold) {
  meet();
  far.reset();
  EXPECT_TRUE(near->wait(kSoon));
  std::array<std::uint8_t, 8> buffer{};
  const Transfer end = near->receive(buffer);
  EXPECT_EQ(end.broken, Transfer::kHungUp);
  const Error error = broken(*near, end);
  EXPECT_EQ(error.code, ErrorCode::kNoAnswer);
  EXPECT_THAT(error.message, HasSubstr(near->name() + " broke: the other side closed it"));
}

TEST_F(LinkOverTcp, AListenerHearsTheNextOneWhenTheFirstHasGone) {
  meet();
  near.reset();
  EXPECT_TRUE(far->wait(kSoon));
  std::array<std::uint8_t, 8> buffer{};
  EXPECT_EQ(far->receive(buffer).broken, Transfer::kHungUp);
  EXPECT_EQ(far->receive(buffer).broken, 0) << "told once";
  meet();
}

TEST(LinkOverUdp, AListenerAnswersWhomItHeardLast) {
  const auto far = opened("udp-listen:127.0.0.1:0");
  const std::array<std::uint8_t, 2> question{1, 2}, answer{3, 4};
  EXPECT_EQ(far->send(answer).bytes, 0u) << "nobody was heard";
  for (int i = 0; i < 2; ++i) {
    const auto near = opened(here("udp", far->local_port()));
    EXPECT_EQ(near->send(question).bytes, 2u);
    EXPECT_THAT(receive(*far, 2), ElementsAre(1, 2));
    EXPECT_EQ(far->send(answer).bytes, 2u);
    EXPECT_THAT(receive(*near, 2), ElementsAre(3, 4));
  }
}

TEST(LinkOverUdp, AnOwnPortIsHeardOn) {
  const auto far = opened("udp-listen:127.0.0.1:0");
  const std::uint16_t own = opened("udp-listen:127.0.0.1:0")->local_port();
  const auto near = opened(here("udp", far->local_port()) + ":" + std::to_string(own));
  EXPECT_EQ(near->local_port(), own);
}

TEST(LinkOverUdp, ADatagramIsOneReceive) {
  const auto far = opened("udp-listen:127.0.0.1:0");
  const auto near = opened(here("udp", far->local_port()));
  const std::array<std::uint8_t, 5> longer{1, 2, 3, 4, 5};
  const std::array<std::uint8_t, 1> shorter{6};
  (void)near->send(longer);
  (void)near->send(shorter);
  ASSERT_TRUE(far->wait(kSoon));
  std::array<std::uint8_t, 3> buffer{};
  EXPECT_EQ(far->receive(buffer).bytes, 3u) << "cut";
  ASSERT_TRUE(far->wait(kSoon));
  EXPECT_EQ(far->receive(buffer).bytes, 1u);
  EXPECT_EQ(buffer[0], 6);
}

TEST(LinkOverUdp, NobodyThereIsNoFailureSinceSomebodyMayComeLater) {
  const std::uint16_t free = opened("udp-listen:127.0.0.1:0")->local_port();
  const auto near = opened(here("udp", free));
  const std::array<std::uint8_t, 2> question{1, 2};
  std::array<std::uint8_t, 8> buffer{};
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(near->send(question).broken, 0);
    EXPECT_EQ(near->receive(buffer).broken, 0);
  }
}

TEST(LinkOpen, NobodyListeningIsToldWithTheNextStep) {
  const std::uint16_t free = opened("tcp-listen:127.0.0.1:0")->local_port();
  const Error error = refused(here("tcp", free));
  EXPECT_EQ(error.code, ErrorCode::kNoAnswer);
  EXPECT_EQ(error.field, "port");
  EXPECT_THAT(error.message, HasSubstr("start the flight controller"));
}

TEST(LinkOpen, AConnectionThatNobodyAnswersEndsInTime) {
  const auto full = opened("tcp-listen:127.0.0.1:0");  // accepts nothing: once its queue is full, it answers nobody
  std::vector<std::unique_ptr<Link>> waiting;
  const auto begin = std::chrono::steady_clock::now();
  for (int i = 0; i < 20; ++i) {
    auto link = open(*parse_address(here("tcp", full->local_port())), 50ms);
    if (!link) {
      EXPECT_EQ(link.failure().code, ErrorCode::kNoAnswer);
      EXPECT_THAT(link.error(), HasSubstr("no answer within 0.05 s"));
      EXPECT_LT(std::chrono::steady_clock::now() - begin, 5s);
      return;
    }
    waiting.push_back(std::move(link).value());
  }
  FAIL() << "everybody was let in";
}

TEST(LinkOpen, APortInUseAndAForeignHostAreTold) {
  for (const char* kind : {"tcp-listen", "udp-listen"}) {
    const auto first = opened(std::string(kind) + ":127.0.0.1:0");
    const Error taken = refused(here(kind, first->local_port()));
    EXPECT_EQ(taken.field, "port");
    EXPECT_EQ(taken.value, std::to_string(first->local_port()));
    EXPECT_THAT(taken.message, HasSubstr("is in use"));

    const Error foreign = refused(std::string(kind) + ":192.0.2.1:5000");
    EXPECT_EQ(foreign.field, "host");
    EXPECT_THAT(foreign.message, HasSubstr("no address of this machine"));
  }
}

}  // namespace
}  // namespace gatefield::firmware
