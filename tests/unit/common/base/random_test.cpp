#include "common/base/random.h"

#include <gtest/gtest.h>

#include <algorithm>
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
  for (const int count : bins) EXPECT_NEAR(count, 0.1 * kDraws, 475);
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

// Every stream of the product (tests/structure/streams.sh holds that) and those that look like a neighbour of one.
constexpr Stream kNames[] = {
    Stream("gatefield.perturbation"),   Stream("gatefield.sensor_noise"),
    Stream("gatefield.depth_scale"),    Stream("gatefield.state_noise"),
    Stream("gatefield.drift"),          Stream("gatefield.jumps"),
    Stream("gatefield.stamps"),         Stream("gatefield.mounting"),
    Stream("gatefield.battery"),        Stream("gatefield.furniture"),
    Stream("gatefield.link"),           Stream("gatefield.outage"),
    Stream("gatefield.rollouts"),       Stream("gatefield.texture"),
    Stream("gatefield.ransac"),         Stream("gatefield.encoder_trial"),
    Stream("gatefield.decoder_trial"),  Stream("gatefield.decoder_comparison"),
    Stream("gatefield.firmware.gyro"),  Stream("gatefield.hil.accelerometer"),
    Stream("gatefield.hil.gyro"),       Stream("gatefield.hil.magnetometer_and_barometer"),
    Stream("gatefield.hil.satellites"), Stream("gatefield.tune.search"),
    Stream("gatefield.rollouts "),      Stream(""),
    Stream("gatefield.perturbation1"),
};

TEST(Stream, TwoNamesNeverShareAKey) {
  constexpr std::uint64_t kSeeds = 100'001;
  std::vector<std::uint64_t> keys;
  for (const Stream& name : kNames)
    for (std::uint64_t seed = 0; seed < kSeeds; ++seed) keys.push_back(stream_key(seed, name));
  std::sort(keys.begin(), keys.end());
  EXPECT_EQ(std::adjacent_find(keys.begin(), keys.end()), keys.end());
}

TEST(Stream, TwoNamesAreFartherApartThanAnyTwoSeeds) {
  for (const Stream& a : kNames)
    for (const Stream& b : kNames) EXPECT_TRUE(&a == &b || (a.hash() ^ b.hash()) > std::uint64_t{1} << 32);
}

TEST(Stream, FirstDrawsDiffer) {
  for (const std::uint64_t seed : {std::uint64_t{0}, std::uint64_t{1}, std::uint64_t{1001}, ~std::uint64_t{0}}) {
    std::set<std::uint64_t> seen;
    for (const Stream& name : kNames)
      for (const std::uint64_t index : {0u, 1u, 2u}) {
        Random random(seed, name, index);
        const std::uint64_t high = random.bits();
        seen.insert(high << 32 | random.bits());
      }
    EXPECT_EQ(seen.size(), 3 * std::size(kNames)) << seed;
  }
}

TEST(Stream, StepsOfOneStreamAreNoDrawsOfAnother) {
  // The counter of the planner's noise is (sample, interval, step), that of Random (draws, stream): with one key for
  // both, step 1 would draw the bits of stream 1.
  const std::uint64_t seed = 7;
  const auto block = [](std::uint64_t key, std::uint32_t step) {
    return philox({0, 0, step, 0}, {static_cast<std::uint32_t>(key), static_cast<std::uint32_t>(key >> 32)});
  };
  EXPECT_EQ(Random(seed, 1).bits(), block(seed, 1)[0]);
  Random perturbation(seed, Stream("gatefield.perturbation"), 1);
  EXPECT_NE(perturbation.bits(), block(stream_key(seed, Stream("gatefield.rollouts")), 1)[0]);
}

TEST(Stream, ANameIsAKeyOnEveryMachine) {
  EXPECT_EQ(Stream("").hash(), 0xcbf29ce484222325ull) << "FNV-1a of nothing";
  EXPECT_EQ(Stream("a").hash(), 0xaf63dc4c8601ec8cull) << "FNV-1a's published value";
  EXPECT_EQ(stream_key(0xcbf29ce484222325ull, Stream("")), 0u) << "the mix keeps 0";
}

}  // namespace
}  // namespace gatefield
