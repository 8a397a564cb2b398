#include "client/firmware/link/shared_link.h"

#include <gtest/gtest.h>

#include <array>
#include <vector>

#include "tests/support/link_pair.h"

namespace gatefield::firmware {
namespace {

class SharedLinkTest : public testing::Test {
 protected:
  void say(std::uint8_t first, std::size_t count) {
    std::vector<std::uint8_t> bytes(count);
    for (std::size_t i = 0; i < count; ++i) bytes[i] = static_cast<std::uint8_t>(first + i);
    board_.send(bytes);
  }
  static std::vector<std::uint8_t> all_of(Link* link) {
    std::vector<std::uint8_t> heard;
    std::array<std::uint8_t, 100> buffer{};
    while (const auto count = link->receive(buffer).bytes)
      heard.insert(heard.end(), buffer.begin(), buffer.begin() + static_cast<std::ptrdiff_t>(count));
    return heard;
  }

  std::shared_ptr<test::Cable> cable_ = std::make_shared<test::Cable>();
  test::CableEnd board_{cable_, false};
  SharedLink shared_{std::make_unique<test::CableEnd>(cable_, true)};
  std::unique_ptr<Link> one_ = shared_.taker(), other_ = shared_.taker();
};

TEST_F(SharedLinkTest, AllHearEverything) {
  say(1, 5);
  EXPECT_EQ(all_of(one_.get()), (std::vector<std::uint8_t>{1, 2, 3, 4, 5}));
  say(6, 2);
  EXPECT_TRUE(other_->wait(std::chrono::seconds(0)));
  EXPECT_EQ(all_of(other_.get()), (std::vector<std::uint8_t>{1, 2, 3, 4, 5, 6, 7}));
  EXPECT_EQ(all_of(one_.get()), (std::vector<std::uint8_t>{6, 7}));
  EXPECT_FALSE(one_->wait(std::chrono::seconds(0)));
}

TEST_F(SharedLinkTest, WhatTheySendGoesOutWhole) {
  const std::array<std::uint8_t, 3> first{1, 2, 3}, second{4, 5, 6};
  EXPECT_EQ(one_->send(first).bytes, 3u);
  EXPECT_EQ(other_->send(second).bytes, 3u);
  EXPECT_EQ(all_of(&board_), (std::vector<std::uint8_t>{1, 2, 3, 4, 5, 6}));
  EXPECT_EQ(one_->name(), "cable");
}

TEST_F(SharedLinkTest, WhoDoesNotReadLosesTheOldest) {
  for (int i = 0; i < 70; ++i) {
    say(static_cast<std::uint8_t>(i), 1000);
    EXPECT_EQ(all_of(one_.get()).size(), 1000u);
  }
  const auto kept = all_of(other_.get());
  ASSERT_EQ(kept.size(), SharedLink::kKept);
  EXPECT_EQ(kept.back(), static_cast<std::uint8_t>(69 + 999));
}

TEST_F(SharedLinkTest, EachIsToldThatItBrokeAfterWhatCameBefore) {
  say(1, 2);
  ASSERT_EQ(all_of(one_.get()).size(), 2u);
  cable_->broken = EIO;
  std::array<std::uint8_t, 10> buffer{};
  EXPECT_EQ(one_->receive(buffer).broken, EIO);
  EXPECT_EQ(other_->receive(buffer).bytes, 2u);
  EXPECT_EQ(other_->receive(buffer).broken, EIO);
  EXPECT_EQ(other_->send(std::array<std::uint8_t, 1>{}).broken, EIO);
}

TEST_F(SharedLinkTest, TheConnectionLivesAsLongAsATaker) {
  { const SharedLink gone = std::move(shared_); }
  other_.reset();
  say(9, 1);
  EXPECT_EQ(all_of(one_.get()), (std::vector<std::uint8_t>{9}));
}

}  // namespace
}  // namespace gatefield::firmware
