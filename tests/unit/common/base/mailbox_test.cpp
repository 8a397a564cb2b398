#include "common/base/mailbox.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <thread>
#include <vector>

namespace gatefield {
namespace {

TEST(Mailbox, IsEmptyAtFirst) {
  Mailbox<int> mailbox;
  EXPECT_FALSE(mailbox.fresh());
  EXPECT_EQ(mailbox.read(), nullptr);
}

TEST(Mailbox, GivesTheNewestValueOnce) {
  Mailbox<int> mailbox;
  mailbox.write(1);
  mailbox.write(2);
  mailbox.write(3);
  ASSERT_TRUE(mailbox.fresh());
  const int* value = mailbox.read();
  ASSERT_NE(value, nullptr);
  EXPECT_EQ(*value, 3);
  EXPECT_FALSE(mailbox.fresh());
  EXPECT_EQ(mailbox.read(), nullptr);
}

TEST(Mailbox, LeavesTheReadersValueAloneUntilItReadsAgain) {
  Mailbox<int> mailbox;
  mailbox.write(1);
  const int* value = mailbox.read();
  ASSERT_NE(value, nullptr);
  for (int i = 2; i < 10; ++i) mailbox.write(i);
  EXPECT_EQ(*value, 1);
  EXPECT_EQ(*mailbox.read(), 9);
}

TEST(Mailbox, SlotsKeepTheirCapacity) {
  Mailbox<std::vector<int>> mailbox;
  std::vector<const int*> storage;
  for (int round = 0; round < 30; ++round) {
    mailbox.slot().assign(100, round);
    mailbox.publish();
    const std::vector<int>* value = mailbox.read();
    ASSERT_NE(value, nullptr);
    EXPECT_EQ(value->front(), round);
    // After each slot was filled once, the same three pieces of memory go round.
    if (round >= 3) storage.push_back(value->data());
  }
  std::sort(storage.begin(), storage.end());
  EXPECT_LE(std::unique(storage.begin(), storage.end()) - storage.begin(), 3);
}

/// Large enough that a copy takes many instructions: a torn value would show unequal words.
struct Message {
  std::array<std::uint64_t, 64> words{};
};

TEST(Mailbox, TwoThreadsNeverSeeATornOrAnOlderValue) {
  Mailbox<Message> mailbox;
  constexpr std::uint64_t kLast = 100'000;
  std::thread writer([&] {
    for (std::uint64_t i = 1; i <= kLast; ++i) {
      mailbox.slot().words.fill(i);
      mailbox.publish();
      if (i % 64 == 0) std::this_thread::yield();
    }
  });
  std::uint64_t newest = 0;
  std::uint64_t torn = 0;
  std::uint64_t older = 0;
  while (newest < kLast) {
    const Message* message = mailbox.read();
    if (message == nullptr) {
      std::this_thread::yield();
      continue;
    }
    const std::uint64_t value = message->words.front();
    for (const std::uint64_t word : message->words) torn += word != value ? 1 : 0;
    older += value <= newest ? 1 : 0;
    newest = value;
    if (torn + older > 0) break;
  }
  writer.join();
  EXPECT_EQ(torn, 0u);
  EXPECT_EQ(older, 0u);
  EXPECT_EQ(newest, kLast);  // the last value is never lost
}

}  // namespace
}  // namespace gatefield
