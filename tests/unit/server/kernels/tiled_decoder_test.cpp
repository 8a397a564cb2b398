// The decoder on tiles, with tiles that are emulated to the bit: layouts, odd sizes, tails and precision on any
// machine.

#include <gtest/gtest.h>

#include <limits>

#include "server/kernels/backend.h"
#include "tests/support/decoder_cases.h"
#include "tests/unit/server/kernels/emulated_decoder.h"

namespace gatefield::kernels {
namespace {

std::uint32_t pair(float even, float odd) {
  return std::bit_cast<std::uint32_t>(even) >> 16 | (std::bit_cast<std::uint32_t>(odd) & 0xffff0000u);
}

TEST(EmulatedTiles, MultiplyAsTheManualSays) {
  alignas(64) std::uint32_t a[256] = {}, b[256] = {};
  alignas(64) float c[256] = {};
  a[3 * 16 + 2] = pair(2.0f, 3.0f);   // row 3, pair 2
  b[2 * 16 + 5] = pair(5.0f, -7.0f);  // pair 2, column 5
  a[4 * 16 + 0] = pair(std::numeric_limits<float>::min() / 4, 1.0f);
  b[0 * 16 + 6] = pair(1e30f, std::numeric_limits<float>::min());
  a[5 * 16 + 0] = pair(0.5f, 0.5f);  // half of the least normal number is none
  EmulatedTiles::Configure();
  EmulatedTiles::Load<4>(a);
  EmulatedTiles::Load<6>(b);
  EmulatedTiles::Zero<0>();
  EmulatedTiles::Dot<0, 4, 6>();
  EmulatedTiles::Dot<0, 4, 6>();
  EmulatedTiles::Store<0>(c);
  EmulatedTiles::Release();
  EXPECT_EQ(c[3 * 16 + 5], 2 * (2.0f * 5.0f - 3.0f * 7.0f));
  EXPECT_EQ(c[4 * 16 + 6], 2 * std::numeric_limits<float>::min());
  EXPECT_NEAR(c[5 * 16 + 6], 1e30f, 1e28f);
  c[3 * 16 + 5] = c[4 * 16 + 6] = c[5 * 16 + 6] = 0.0f;
  for (const float value : c) EXPECT_EQ(value, 0.0f);
}

TEST(TiledDecoder, FollowsTheReferenceForEveryShape) {
  for (const Shape& shape : kShapes) {
    if (shape.hidden.empty()) continue;  // there is nothing to multiply in tiles
    const DecoderWeights weights = random_weights(shape.kind, shape.hidden, shape.octaves, 5);
    FoldedDecoder folded;
    fold(prepare_emulated(weights), random_latent(weights.latent_size, 6), Eigen::Isometry3d::Identity(), &folded);
    const Points points(75);
    std::vector<float> sdf(75), reference(75);
    folded.decode(points.x, points.y, points.z, sdf);
    decode_reference(folded, points.x, points.y, points.z, reference);
    for (std::size_t i = 0; i < sdf.size(); ++i)
      ASSERT_NEAR(sdf[i], reference[i], 1e-3) << "first width " << shape.hidden[0] << ", point " << i;
  }
}

TEST(TiledDecoder, TakesAnyNumberOfPoints) {
  const DecoderWeights weights = random_weights(DecoderKind::kConcatenated, {40, 24}, 4, 8);
  FoldedDecoder folded;
  fold(prepare_emulated(weights), random_latent(weights.latent_size, 9), Eigen::Isometry3d::Identity(), &folded);
  const Points all(99, 3);
  std::vector<float> expected(99);
  folded.decode(all.x, all.y, all.z, expected);
  for (const std::size_t count : {0, 1, 15, 16, 17, 31, 32, 33, 48, 63, 64, 98}) {
    Points some = all;
    for (auto* values : {&some.x, &some.y, &some.z}) values->resize(count);
    std::vector<float> sdf(count + 1, -7.0f);
    folded.decode(some.x, some.y, some.z, std::span(sdf).first(count));
    EXPECT_EQ(sdf.back(), -7.0f);
    for (std::size_t i = 0; i < count; ++i) ASSERT_EQ(sdf[i], expected[i]) << i << " of " << count;
  }
}

TEST(TiledDecoder, TheMachinesOwnTilesFollowTheEmulatedOnes) {
  const Backend* const own = find_backend("avx3_amx");
  if (own == nullptr || !own->supported()) GTEST_SKIP() << "no AMX here";
  for (const int width : {16, 64, 100, 128}) {
    const DecoderWeights weights = random_weights(DecoderKind::kHyper, {width, width}, 0, 5);
    const std::vector<float> latent = random_latent(weights.latent_size, 6);
    FoldedDecoder folded, folded_emulated;
    fold(own->prepare(weights), latent, Eigen::Isometry3d::Identity(), &folded);
    fold(prepare_emulated(weights), latent, Eigen::Isometry3d::Identity(), &folded_emulated);
    const Points points(77);
    std::vector<float> sdf(77), emulated(77);
    folded_emulated.decode(points.x, points.y, points.z, emulated);
    folded.decode(points.x, points.y, points.z, sdf);
    for (std::size_t i = 0; i < sdf.size(); ++i) ASSERT_NEAR(sdf[i], emulated[i], 1e-3) << width;
  }
}

}  // namespace
}  // namespace gatefield::kernels
