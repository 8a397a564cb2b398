#include "server/kernels/backend.h"

#include <gmock/gmock.h>

#include <set>
#include <thread>
#include <vector>

#include "tests/support/decoder_cases.h"
#include "tests/unit/server/kernels/every_backend.h"

namespace gatefield::kernels {
namespace {

using testing::Contains;
using testing::HasSubstr;

std::vector<std::string> names(std::span<const Backend* const> backends) {
  std::vector<std::string> all;
  for (const Backend* backend : backends) all.emplace_back(backend->name());
  return all;
}

TEST(Backends, AtLeastThePortableOneIsAvailableAndNoneIsThereTwice) {
  const std::vector<std::string> available = names(available_backends());
  ASSERT_FALSE(available.empty());
  EXPECT_EQ(std::set<std::string>(available.begin(), available.end()).size(), available.size());
#if defined(__x86_64__)
  EXPECT_THAT(available, Contains("sse4"));
  EXPECT_THAT(available.back(), testing::AnyOf("scalar", "emu128"));
#elif defined(__aarch64__)
  EXPECT_EQ(available.front(), "neon");  // which every such machine has
#endif
}

TEST(Backends, AreFoundByTheirNames) {
  for (const Backend* backend : backends()) {
    EXPECT_EQ(find_backend(backend->name()), backend);
    EXPECT_EQ(select_backend(backend->name()).ok(), backend->supported());
  }
  EXPECT_EQ(find_backend("avx9000"), nullptr);
}

TEST(Backends, AutoTakesTheBestWhichIsNeverALessExactOne) {
  const auto chosen = select_backend("auto");
  ASSERT_TRUE(chosen.ok());
  EXPECT_EQ(*chosen, &best_backend());
  EXPECT_EQ(*chosen, available_backends().front());
  EXPECT_EQ((*chosen)->decode_tolerance_m(), 1e-4);
}

TEST(Backends, AnUnknownNameIsRefusedWithTheList) {
  const auto chosen = select_backend("avx9000");
  ASSERT_FALSE(chosen.ok());
  EXPECT_EQ(chosen.failure().code, ErrorCode::kUnsupported);
  EXPECT_THAT(chosen.error(), HasSubstr("'avx9000'"));
  for (const std::string& name : names(available_backends())) EXPECT_THAT(chosen.error(), HasSubstr(name));
}

/// One step's work on one back end, all results in a row.
std::vector<float> work(const Backend& backend) {
  constexpr NoiseShape kShape{{3, 3, 3, 9}, {{{1, -1, -1, 1}, {1, 1, 1, 1}, {1, 1, -1, -1}, {1, -1, 1, -1}}}};
  constexpr int kSteps = 5, kSamples = 100;
  QuadrotorState start;
  start.v_WB = {6, 0, 0};
  start.thrust_n = start.thrust_command_n = hover_thrust_n(QuadrotorModel{});
  OwnedBlock inputs(kSteps, kInputs, kSamples), states(kSteps, kStateChannels, kSamples);
  const std::vector<float> mean(kSteps * kInputs);
  backend.sample(kShape, 1, 2, 0, mean.data(), inputs.block());
  backend.rollout(QuadrotorModel{}, start, 0.03, inputs.block(), states.block());
  const DecoderWeights weights = random_weights(DecoderKind::kHyper, {64, 64}, 0, 5);
  FoldedDecoder folded;
  fold(backend.prepare(weights), random_latent(weights.latent_size, 6), Eigen::Isometry3d::Identity(), &folded);
  std::vector<float> sdf(kSamples), weight(kSamples), all;
  const auto row = [&](int channel) {
    return std::span<const float>(states.block().row(kSteps - 1, channel), kSamples);
  };
  folded.decode(row(kPx), row(kPy), row(kPz), sdf);
  backend.softmax_weights(sdf, backend.temperature_for(sdf, 10, 1e-3, 1e3), weight);
  std::vector<double> average(kSteps * kInputs);
  backend.accumulate_average(weight, inputs.block(), average.data());
  for (int channel = 0; channel < kStateChannels; ++channel)
    all.insert(all.end(), row(channel).begin(), row(channel).end());
  for (const std::vector<float>* part : {&sdf, &weight}) all.insert(all.end(), part->begin(), part->end());
  for (const double value : average) all.push_back(static_cast<float>(value));
  return all;
}

TEST(Backends, EachGivesAmongOthersWhatItGivesAlone) {
  std::vector<std::vector<float>> alone;
  for (const Backend* backend : available_backends()) alone.push_back(work(*backend));
  std::vector<int> wrong(alone.size(), 0);
  std::vector<std::thread> threads;
  for (std::size_t i = 0; i < alone.size(); ++i) {
    threads.emplace_back([&, i] {
      for (int turn = 0; turn < 20; ++turn) wrong[i] += work(*available_backends()[i]) == alone[i] ? 0 : 1;
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(wrong, std::vector<int>(alone.size(), 0));
}

}  // namespace
}  // namespace gatefield::kernels
