#include "client/flight/doorbell.h"

#include <gtest/gtest.h>

#include <thread>

#include "common/base/mailbox.h"

namespace gatefield::flight {
namespace {

using namespace std::chrono_literals;

TEST(Doorbell, AWaitWithoutARingEnds) {
  Doorbell bell;
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_FALSE(bell.wait_for(20ms));
  EXPECT_GE(std::chrono::steady_clock::now() - begin, 20ms);
}

TEST(Doorbell, ARingBeforeTheWaitIsNotLost) {
  Doorbell bell;
  bell.ring();
  EXPECT_TRUE(bell.wait_for(0ms));
  EXPECT_FALSE(bell.wait_for(0ms));
}

TEST(Doorbell, WhoWaitsGetsTheNewestFromTheMailboxAndTheLastOneAlways) {
  Doorbell bell;
  Mailbox<int> box;
  constexpr int kLast = 10000;
  std::thread writer([&] {
    for (int i = 1; i <= kLast; ++i) {
      box.write(i);
      bell.ring();
    }
  });
  int newest = 0;
  while (newest < kLast) {
    ASSERT_TRUE(bell.wait_for(10s));
    if (const int* value = box.read()) {
      EXPECT_GT(*value, newest);
      newest = *value;
    }
  }
  writer.join();
}

}  // namespace
}  // namespace gatefield::flight
