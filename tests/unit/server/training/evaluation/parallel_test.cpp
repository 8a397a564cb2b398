#include "server/training/evaluation/parallel.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <thread>
#include <vector>

namespace gatefield::training {
namespace {

TEST(ForEachIndex, TakesEveryIndexOnce) {
  for (const int threads : {1, 3}) {
    std::vector<std::atomic<int>> taken(1000);
    std::uint64_t last = 0;
    EXPECT_TRUE(for_each_index(
        taken.size(), threads,
        [&](int thread, std::uint64_t i) {
          ASSERT_LT(thread, threads);
          ++taken[i];
        },
        [&](std::uint64_t done) {
          last = done;
          return true;
        }));
    for (const auto& times : taken) EXPECT_EQ(times, 1);
    EXPECT_EQ(last, taken.size());
  }
}

TEST(ForEachIndex, StopsWhenAsked) {
  std::atomic<int> taken{0};
  EXPECT_FALSE(for_each_index(
      1'000'000, 2,
      [&](int, std::uint64_t) {
        ++taken;
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
      },
      [](std::uint64_t) { return false; }));
  EXPECT_LT(taken, 10'000);
}

}  // namespace
}  // namespace gatefield::training
