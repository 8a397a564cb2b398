#include "server/kernels/decoder/decoder.h"

#include <cmath>
#include <limits>
#include <numbers>
#include <string>

#include "common/base/random.h"
#include "tests/support/decoder_cases.h"
#include "tests/unit/server/kernels/every_backend.h"

namespace gatefield::kernels {
namespace {

class DecoderTest : public EveryBackend {};

Eigen::Isometry3d capture_pose() {
  Eigen::Isometry3d X_WC = Eigen::Isometry3d::Identity();
  X_WC.translate(Eigen::Vector3d(2.0, -3.0, 1.5));
  X_WC.rotate(Eigen::AngleAxisd(1.1, Eigen::Vector3d(0.4, -0.7, 0.6).normalized()));
  return X_WC;
}

/// The network as bundle.h defines it, in double precision, straight from the weights: no folding, no packing.
double plain_network(const DecoderWeights& weights, std::span<const float> latent, const Eigen::Isometry3d& X_WC,
                     const Eigen::Vector3d& p_W) {
  const Eigen::Vector3d p_C = X_WC.inverse() * p_W;
  std::vector<double> a;
  if (weights.kind == DecoderKind::kHyper) {
    std::vector<double> generated;
    const auto inputs = static_cast<std::size_t>(weights.generator.inputs);
    for (std::size_t i = 0; i < static_cast<std::size_t>(weights.generator.outputs); ++i) {
      double value = weights.generator.bias[i];
      for (std::size_t j = 0; j < inputs; ++j)
        value += double{weights.generator.weight[i * inputs + j]} * latent[3 + j];
      generated.push_back(value);
    }
    const std::size_t hidden = generated.size() / 4;
    const Eigen::Vector3d offset = (p_C - Eigen::Vector3d(latent[0], latent[1], latent[2])) / weights.position_scale_m;
    for (std::size_t i = 0; i < hidden; ++i) {
      const double value = generated[3 * i] * offset.x() + generated[3 * i + 1] * offset.y() +
                           generated[3 * i + 2] * offset.z() + generated[3 * hidden + i];
      a.push_back(std::max(value, 0.0));
    }
  } else {
    a.assign(latent.begin(), latent.end());
    for (int axis = 0; axis < 3; ++axis) a.push_back(p_C[axis]);
    for (int octave = 0; octave < weights.encoding_octaves; ++octave) {
      const double factor = std::pow(2.0, octave) * std::numbers::pi / weights.position_scale_m;
      for (int axis = 0; axis < 3; ++axis) a.push_back(std::sin(factor * p_C[axis]));
      for (int axis = 0; axis < 3; ++axis) a.push_back(std::cos(factor * p_C[axis]));
    }
  }
  for (std::size_t l = 0; l < weights.layers.size(); ++l) {
    const Dense& layer = weights.layers[l];
    std::vector<double> next;
    for (std::size_t i = 0; i < static_cast<std::size_t>(layer.outputs); ++i) {
      double value = layer.bias[i];
      for (std::size_t j = 0; j < a.size(); ++j) value += double{layer.weight[i * a.size() + j]} * a[j];
      next.push_back(l + 1 < weights.layers.size() ? std::max(value, 0.0) : value);
    }
    a = std::move(next);
  }
  return a[0];
}

TEST_P(DecoderTest, GivesWhatThePlainNetworkGives) {
  const Eigen::Isometry3d X_WC = capture_pose();
  for (const Shape& shape : kShapes) {
    const DecoderWeights weights = random_weights(shape.kind, shape.hidden, shape.octaves, 5);
    const std::vector<float> latent = random_latent(weights.latent_size, 6);
    FoldedDecoder folded;
    fold(backend().prepare(weights), latent, X_WC, &folded);
    const Points points(150);
    std::vector<float> sdf(150), reference(150);
    folded.decode(points.x, points.y, points.z, sdf);
    decode_reference(folded, points.x, points.y, points.z, reference);
    for (std::size_t i = 0; i < 150; ++i) {
      const double expected = plain_network(weights, latent, X_WC, {points.x[i], points.y[i], points.z[i]});
      ASSERT_NEAR(reference[i], expected, 1e-4)
          << "reference, first width " << (shape.hidden.empty() ? 0 : shape.hidden[0]);
      ASSERT_NEAR(sdf[i], reference[i], backend().decode_tolerance_m())
          << "first width " << (shape.hidden.empty() ? 0 : shape.hidden[0]);
    }
  }
}

TEST_P(DecoderTest, SumsOfTheLargestWeightsAndActivationsStayWhole) {
  // Every weight and every activation as large as all others, and all of one sign: the most that sums can become.
  for (const int width : {1, 2, 17, 64, 255, 256}) {
    DecoderWeights weights = random_weights(DecoderKind::kHyper, {width, width}, 0, 3);
    for (float& value : weights.generator.weight) value = 0.0f;
    for (std::size_t i = 0; i < weights.generator.bias.size(); ++i)
      weights.generator.bias[i] = i < 3 * static_cast<std::size_t>(width) ? 1.0f : 50.0f;
    for (const float value : {3.0f, -3.0f}) {
      std::fill(weights.layers[0].weight.begin(), weights.layers[0].weight.end(), value);
      std::fill(weights.layers[0].bias.begin(), weights.layers[0].bias.end(), value > 0 ? 0.0f : 1e6f);
      std::fill(weights.layers[1].weight.begin(), weights.layers[1].weight.end(), 0.25f);
      FoldedDecoder folded;
      fold(backend().prepare(weights), std::vector<float>(32, 0.0f), Eigen::Isometry3d::Identity(), &folded);
      const Points points(40);
      std::vector<float> sdf(40), reference(40);
      folded.decode(points.x, points.y, points.z, sdf);
      decode_reference(folded, points.x, points.y, points.z, reference);
      for (std::size_t i = 0; i < sdf.size(); ++i)
        ASSERT_NEAR(sdf[i], reference[i], 1e-3 * std::abs(reference[i])) << width << ", " << value;
    }
  }
}

TEST_P(DecoderTest, TakesAnyNumberOfPointsFromAnyAddress) {
  const DecoderWeights weights = random_weights(DecoderKind::kConcatenated, {40, 24}, 4, 8);
  FoldedDecoder folded;
  fold(backend().prepare(weights), random_latent(weights.latent_size, 9), capture_pose(), &folded);
  const Points points(205, 3);
  std::vector<float> all(205);
  folded.decode(points.x, points.y, points.z, all);
  for (std::size_t first = 0; first < 3; ++first) {
    for (std::size_t count = 0; count <= 200; count += count < 67 ? 1 : 19) {
      std::vector<float> sdf(count + 2, -7.0f);
      folded.decode(std::span(points.x).subspan(first, count), std::span(points.y).subspan(first, count),
                    std::span(points.z).subspan(first, count), std::span(sdf).subspan(1, count));
      EXPECT_EQ(sdf.front(), -7.0f);
      EXPECT_EQ(sdf.back(), -7.0f);
      for (std::size_t i = 0; i < count; ++i) ASSERT_EQ(sdf[i + 1], all[first + i]) << i << " of " << count;
    }
  }
}

TEST_P(DecoderTest, StaysFiniteForFinitePointsAndSaysNanForOthers) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  for (const Shape& shape : kShapes) {
    const DecoderWeights weights = random_weights(shape.kind, shape.hidden, shape.octaves, 15);
    FoldedDecoder folded;
    fold(backend().prepare(weights), random_latent(weights.latent_size, 16), capture_pose(), &folded);
    Points points(20);
    const float finite[] = {3e38f, -3e38f, 1e30f, -1e20f, 1e9f, 1e-45f, 0.0f, -0.0f};
    std::copy(std::begin(finite), std::end(finite), points.x.begin());
    std::copy(std::begin(finite), std::end(finite), points.y.begin() + 3);
    const float others[] = {kInfinity, -kInfinity, std::nanf("")};
    std::copy(std::begin(others), std::end(others), points.z.begin() + 12);
    points.x[16] = kInfinity;
    points.y[17] = std::nanf("");
    std::vector<float> sdf(20), reference(20);
    folded.decode(points.x, points.y, points.z, sdf);
    decode_reference(folded, points.x, points.y, points.z, reference);
    for (std::size_t i = 0; i < 20; ++i) {
      const bool number = std::isfinite(points.x[i]) && std::isfinite(points.y[i]) && std::isfinite(points.z[i]);
      ASSERT_EQ(std::isfinite(sdf[i]), number) << i;
      ASSERT_EQ(std::isfinite(reference[i]), number) << i;
    }
  }
}

TEST_P(DecoderTest, AUnitScalesPointsAndValuesWithTheWorld) {
  for (const double unit_m : {0.3, 2.0}) {
    for (const Shape& shape : kShapes) {
      const auto prepared = backend().prepare(random_weights(shape.kind, shape.hidden, shape.octaves, 5));
      const std::vector<float> latent = random_latent(prepared->weights().latent_size, 6);
      Eigen::Isometry3d scaled_pose = capture_pose();
      scaled_pose.translation() *= unit_m;
      FoldedDecoder own, scaled;
      fold(prepared, latent, capture_pose(), &own);
      fold(prepared, latent, Eigen::Isometry3d::Identity(), &scaled, unit_m);
      scaled.place(scaled_pose);
      const Points points(40);
      Points scaled_points(40);
      for (std::size_t i = 0; i < 40; ++i) {
        scaled_points.x[i] = static_cast<float>(unit_m) * points.x[i];
        scaled_points.y[i] = static_cast<float>(unit_m) * points.y[i];
        scaled_points.z[i] = static_cast<float>(unit_m) * points.z[i];
      }
      std::vector<float> sdf(40), reference(40), expected(40);
      own.decode(points.x, points.y, points.z, expected);
      scaled.decode(scaled_points.x, scaled_points.y, scaled_points.z, sdf);
      decode_reference(scaled, scaled_points.x, scaled_points.y, scaled_points.z, reference);
      for (std::size_t i = 0; i < 40; ++i) {
        const double tolerance_m = unit_m * (backend().decode_tolerance_m() + 1e-4);
        ASSERT_NEAR(sdf[i], unit_m * static_cast<double>(expected[i]), tolerance_m) << i;
        ASSERT_NEAR(reference[i], unit_m * static_cast<double>(expected[i]), tolerance_m) << i;
      }
    }
  }
}

TEST_P(DecoderTest, PlacingIsFoldingThereBitForBit) {
  for (const Shape& shape : kShapes) {
    const auto prepared = backend().prepare(random_weights(shape.kind, shape.hidden, shape.octaves, 5));
    const std::vector<float> latent = random_latent(prepared->weights().latent_size, 6);
    FoldedDecoder moved, there;
    fold(prepared, latent, Eigen::Isometry3d::Identity(), &moved);
    moved.place(capture_pose());
    fold(prepared, latent, capture_pose(), &there);
    const Points points(40);
    std::vector<float> sdf(40), expected(40);
    moved.decode(points.x, points.y, points.z, sdf);
    there.decode(points.x, points.y, points.z, expected);
    EXPECT_EQ(sdf, expected);
  }
}

TEST_P(DecoderTest, AdoptingWhatAnotherBackEndFoldedGivesWhatItFoldsItself) {
  for (const Shape& shape : kShapes) {
    const DecoderWeights weights = random_weights(shape.kind, shape.hidden, shape.octaves, 5);
    const std::vector<float> latent = random_latent(weights.latent_size, 6);
    const auto prepared = backend().prepare(weights);
    const Points points(40);
    std::vector<float> sdf(40), expected(40);
    FoldedDecoder own;
    fold(prepared, latent, capture_pose(), &own);
    own.decode(points.x, points.y, points.z, expected);
    for (const Backend* other : available_backends()) {
      FoldedDecoder folded;
      fold(other->prepare(weights), latent, capture_pose(), &folded);
      adopt(prepared, &folded);
      folded.decode(points.x, points.y, points.z, sdf);
      EXPECT_EQ(sdf, expected) << other->name();
    }
  }
}

TEST_P(DecoderTest, ACopyIsAFieldOfItsOwnAndHoldsTheFirstLayerOnly) {
  const DecoderWeights weights = random_weights(DecoderKind::kHyper, {256, 256, 256}, 0, 5);
  FoldedDecoder copy;
  const Points points(40);
  std::vector<float> sdf(40), expected(40);
  {
    FoldedDecoder original;
    fold(backend().prepare(weights), random_latent(weights.latent_size, 6), capture_pose(), &original);
    original.decode(points.x, points.y, points.z, expected);
    copy = original;
  }
  copy.decode(points.x, points.y, points.z, sdf);
  EXPECT_EQ(sdf, expected);
  EXPECT_LT(size_of(copy), sizeof(float) * weights.layers[0].weight.size() / 4);
}

TEST_P(DecoderTest, FoldingAgainTakesTheNewLatentAndShape) {
  FoldedDecoder folded;
  const Points points(40);
  for (const Shape& shape : kShapes) {
    const DecoderWeights weights = random_weights(shape.kind, shape.hidden, shape.octaves, 25);
    for (const std::uint64_t seed : {1u, 2u}) {
      const std::vector<float> latent = random_latent(weights.latent_size, seed);
      fold(backend().prepare(weights), latent, capture_pose(), &folded);
      FoldedDecoder fresh;
      fold(backend().prepare(weights), latent, capture_pose(), &fresh);
      std::vector<float> again(40), first(40);
      folded.decode(points.x, points.y, points.z, again);
      fresh.decode(points.x, points.y, points.z, first);
      EXPECT_EQ(again, first);
    }
  }
}

ON_EVERY_BACKEND(DecoderTest);

}  // namespace
}  // namespace gatefield::kernels
