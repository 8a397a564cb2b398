#include "common/base/random.h"

#include <gtest/gtest.h>

#include <set>
#include <vector>

namespace gatefield {
namespace {

using Words = std::array<std::uint32_t, 4>;

// Known answers of the generator's authors (Random123, kat_vectors, philox4x32 with 10 rounds).
TEST(Philox, GivesTheAuthorsKnownAnswers) {
  EXPECT_EQ(philox({0, 0, 0, 0}, {0, 0}), (Words{0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8}));
  EXPECT_EQ(philox({0xffffffff, 0xffffffff, 0xffffffff, 0xffffffff}, {0xffffffff, 0xffffffff}),
            (Words{0x408f276d, 0x41c83b0e, 0xa20bc7c6, 0x6d5451fd}));
}

TEST(Random, SameSeedAndStreamGiveTheSameNumbers) {
  Random first(42, 7);
  Random second(42, 7);
  for (int i = 0; i < 1000; ++i) EXPECT_EQ(first.bits(), second.bits());
}

TEST(Random, SeedAndStreamCountInAllTheirBits) {
  std::set<std::uint32_t> seen;
  for (const std::uint64_t seed : {1ull, 2ull, 1ull << 32, 1ull << 63}) {
    for (const std::uint64_t stream : {0ull, 1ull, 1ull << 32, 1ull << 63}) seen.insert(Random(seed, stream).bits());
  }
  EXPECT_EQ(seen.size(), 16u);
}

TEST(Random, UniformFillsItsRangeEvenly) {
  Random random(1);
  std::vector<int> bins(10, 0);
  constexpr int kDraws = 100'000;
  for (int i = 0; i < kDraws; ++i) {
    const double value = random.uniform(-2.0, 3.0);
    ASSERT_GE(value, -2.0);
    ASSERT_LT(value, 3.0);
    ++bins[static_cast<std::size_t>((value + 2.0) * 2.0)];
  }
  // Five sigma of a binomial with p = 0.1.
  for (const int count : bins) EXPECT_NEAR(count, kDraws / 10, 475);
}

TEST(Random, BelowReachesEveryValueAndNoOther) {
  Random random(2);
  std::vector<int> bins(7, 0);
  for (int i = 0; i < 70'000; ++i) ++bins.at(random.below(7));
  for (const int count : bins) EXPECT_NEAR(count, 10'000, 470);
}

TEST(Random, NormalHasTheMomentsOfANormal) {
  Random random(3);
  constexpr int kDraws = 200'000;
  double sum = 0.0;
  double squares = 0.0;
  double fourths = 0.0;
  for (int i = 0; i < kDraws; ++i) {
    const double value = random.normal();
    sum += value;
    squares += value * value;
    fourths += value * value * value * value;
  }
  EXPECT_NEAR(sum / kDraws, 0.0, 0.012);
  EXPECT_NEAR(squares / kDraws, 1.0, 0.016);
  EXPECT_NEAR(fourths / kDraws, 3.0, 0.12);
}

TEST(Random, ChanceOfZeroAndOneAreCertain) {
  Random random(4);
  for (int i = 0; i < 1000; ++i) {
    EXPECT_FALSE(random.chance(0.0));
    EXPECT_TRUE(random.chance(1.0));
  }
}

}  // namespace
}  // namespace gatefield
