// The stated tolerance with the weights that are shipped.

#include <cmath>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/base/random.h"
#include "server/kernels/decoder/decoder.h"
#include "tests/support/decoder_cases.h"
#include "tests/unit/server/kernels/emulated_decoder.h"
#include "tests/unit/server/kernels/every_backend.h"

namespace gatefield::kernels {
namespace {

class ShippedDecoderTest : public EveryBackend {};

/// A shipped model and latents that its encoder gave: of its test case, and of that one mirrored and moved.
struct Shipped {
  explicit Shipped(const std::string& name) {
    auto read = model::Bundle::read(std::string(GATEFIELD_SOURCE_DIR "/deploy/models/") + name);
    EXPECT_TRUE(read.ok()) << read.error();
    bundle.emplace(std::move(read).value());
    std::vector<float> latent = bundle->networks().back().output.values;
    latent.resize(static_cast<std::size_t>(bundle->decoder().latent_size));
    const bool hyper = bundle->decoder().kind == DecoderKind::kHyper;
    for (const float gain : {1.0f, 0.8f, 1.2f}) {
      latents.push_back(latent);
      for (std::size_t i = hyper ? 3 : 0; i < latent.size(); ++i) latents.back()[i] *= gain;
      if (hyper) latents.back()[0] = 0.2f * gain, latents.back()[1] = -0.3f, latents.back()[2] = 4.0f * gain;
    }
  }
  std::optional<model::Bundle> bundle;
  std::vector<std::vector<float>> latents;
};

const Shipped& shipped(const std::string& name) {
  static std::map<std::string, Shipped> models;  // reading evaluates the networks: once is enough
  return models.try_emplace(name, name).first->second;
}

/// Points as far from the gate as the planner asks: 10 m.
struct Ball {
  explicit Ball(std::size_t count) {
    Random random(4);
    while (x.size() < count) {
      const Eigen::Vector3d p(random.uniform(-10, 10), random.uniform(-10, 10), random.uniform(-10, 10));
      if (p.norm() > 10.0) continue;
      x.push_back(static_cast<float>(p.x()));
      y.push_back(static_cast<float>(p.y()));
      z.push_back(static_cast<float>(p.z() + 4.0));
    }
  }
  std::vector<float> x, y, z;
};

/// Largest error of a model's decoder, which it records, over the model's latents.
double worst_error(const std::string& name, const Ball& ball, const std::shared_ptr<const PreparedDecoder>& decoder) {
  static std::map<std::pair<std::string, std::size_t>, std::vector<std::vector<float>>> known;  // slow to compute
  std::vector<std::vector<float>>& references = known[{name, ball.x.size()}];
  references.resize(shipped(name).latents.size());
  double worst = 0.0, squares = 0.0;
  for (std::size_t which = 0; which < references.size(); ++which) {
    const std::vector<float>& latent = shipped(name).latents[which];
    FoldedDecoder folded;
    fold(decoder, latent, Eigen::Isometry3d::Identity(), &folded);
    std::vector<float> sdf(ball.x.size());
    std::vector<float>& reference = references[which];
    folded.decode(ball.x, ball.y, ball.z, sdf);
    if (reference.empty()) {
      reference.resize(ball.x.size());
      decode_reference(folded, ball.x, ball.y, ball.z, reference);
    }
    for (std::size_t i = 0; i < sdf.size(); ++i) {
      const double error = std::abs(double{sdf[i]} - double{reference[i]});
      worst = std::max(worst, error);
      squares += error * error;
    }
  }
  squares /= static_cast<double>(ball.x.size() * shipped(name).latents.size());
  testing::Test::RecordProperty("worst_m_" + name, std::to_string(worst));
  testing::Test::RecordProperty("rms_m_" + name, std::to_string(std::sqrt(squares)));
  return worst;
}

TEST_P(ShippedDecoderTest, KeepsTheStatedTolerance) {
  const Ball ball(2000);
  for (const char* name : {"race", "race-stereo", "race-z64", "paper"}) {
    const double worst = worst_error(name, ball, backend().prepare(shipped(name).bundle->decoder()));
    EXPECT_LE(worst, backend().decode_tolerance_m()) << name;
  }
}

TEST(ShippedDecoder, KeepsTheToleranceStatedForTiles) {
  const Ball ball(200);
  for (const char* name : {"race", "race-stereo", "race-z64", "paper"}) {
    const double worst = worst_error(name, ball, prepare_emulated(shipped(name).bundle->decoder()));
    EXPECT_LE(worst, 1e-3) << name;
  }
}

TEST_P(ShippedDecoderTest, WhatALatentMakesOfItIsAFewKilobytes) {
  for (const char* name : {"race", "race-stereo", "race-z64", "paper"}) {
    FoldedDecoder folded;
    fold(backend().prepare(shipped(name).bundle->decoder()), shipped(name).latents[0], Eigen::Isometry3d::Identity(),
         &folded);
    EXPECT_LE(size_of(folded), 8u << 10) << name;
  }
}

ON_EVERY_BACKEND(ShippedDecoderTest);

}  // namespace
}  // namespace gatefield::kernels
