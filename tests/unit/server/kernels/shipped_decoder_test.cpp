// The stated tolerance with the weights that are shipped.

#include <cmath>
#include <map>
#include <optional>
#include <string>

#include "common/base/random.h"
#include "server/kernels/decoder/decoder.h"
#include "tests/unit/server/kernels/every_isa.h"

namespace gatefield::kernels {
namespace {

using model::DecoderKind;

class ShippedDecoderTest : public EveryIsa {};

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

TEST_P(ShippedDecoderTest, ShippedWeightsKeepTheStatedTolerance) {
  for (const char* name : {"race", "race-stereo", "race-z64", "paper"}) {
    static std::map<std::string, Shipped> models;  // reading evaluates the networks: once is enough
    const Shipped& shipped = models.try_emplace(name, name).first->second;
    double worst = 0.0, squares = 0.0;
    for (const std::vector<float>& latent : shipped.latents) {
      FoldedDecoder folded;
      fold(shipped.bundle->decoder(), latent, Eigen::Isometry3d::Identity(), &folded);
      Random random(4);
      std::vector<float> x, y, z;
      while (x.size() < 3000) {  // as far from the gate as the planner asks
        const Eigen::Vector3d p(random.uniform(-10, 10), random.uniform(-10, 10), random.uniform(-10, 10));
        if (p.norm() > 10.0) continue;
        x.push_back(static_cast<float>(p.x()));
        y.push_back(static_cast<float>(p.y()));
        z.push_back(static_cast<float>(p.z() + 4.0));
      }
      std::vector<float> sdf(3000), reference(3000);
      decode(folded, x, y, z, sdf);
      decode_reference(folded, x, y, z, reference);
      for (std::size_t i = 0; i < sdf.size(); ++i) {
        const double error = std::abs(double{sdf[i]} - double{reference[i]});
        worst = std::max(worst, error);
        squares += error * error / 9000;
      }
    }
    EXPECT_LE(worst, decode_tolerance_m()) << name;
    RecordProperty(std::string("worst_m_") + name, std::to_string(worst));
    RecordProperty(std::string("rms_m_") + name, std::to_string(std::sqrt(squares)));
  }
}

ON_EVERY_ISA(ShippedDecoderTest);

}  // namespace
}  // namespace gatefield::kernels
