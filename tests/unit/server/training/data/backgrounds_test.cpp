#include "server/training/data/backgrounds.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>

#include "tests/unit/server/training/data/frame_folder.h"

namespace gatefield::training {
namespace {

/// One frame: a wall, a hole in its middle, something near at the left.
Backgrounds room(float wall_m) {
  Backgrounds out;
  std::vector<float> measured_m(kImageSize_px, wall_m);
  for (int v = 0; v < kImageHeight_px; ++v)
    for (int u = 0; u < kImageWidth_px; ++u) {
      float& z = measured_m[static_cast<std::size_t>(v) * kImageWidth_px + u];
      if (u < 30) z = 0.6f;
      if (u > 70 && u < 80 && v > 40 && v < 50) z = 0.0f;
    }
  std::vector<float> filled_m = measured_m;
  for (float& z : filled_m) z = z > 0.0f ? z : wall_m;
  out.measured_m.push_back(measured_m);
  out.filled_m.push_back(filled_m);
  return out;
}

scene::SensorNoise stereo() {
  scene::SensorNoise noise;
  noise.active_stereo.emplace();
  return noise;
}

TEST(Backgrounds, GatesStandBeforeTheFrameAndTheRestIsAsRecorded) {
  const Backgrounds backgrounds = room(8.0f);
  int with_gate = 0;
  double same = 0.0, pixels = 0.0;
  for (std::uint64_t index = 0; index < 60; ++index) {
    const Sample sample = compose(backgrounds, stereo(), 5, index);
    ASSERT_EQ(sample.measured_mm.size(), static_cast<std::size_t>(kImageSize_px));
    with_gate += sample.valid_count > 0 ? 1 : 0;
    for (std::size_t i = 0; i < sample.measured_mm.size(); ++i) {
      const auto before = static_cast<std::uint16_t>(1000.0f * backgrounds.measured_m[0][i] + 0.5f);
      same += sample.measured_mm[i] == before ? 1.0 : 0.0;
      pixels += 1.0;
      // What is near in the frame stays before any gate beyond it.
      if (before == 600) EXPECT_LE(sample.measured_mm[i], 800) << index;
    }
  }
  EXPECT_GT(with_gate, 35);
  EXPECT_LT(with_gate, 60);
  EXPECT_GT(same / pixels, 0.6);
  EXPECT_LT(same / pixels, 0.99);
}

TEST(Backgrounds, GatesBehindTheWallAreHiddenAndNotValid) {
  const Backgrounds backgrounds = room(0.5f);  // everything is nearer than any gate can be
  int with_gate = 0;
  for (std::uint64_t index = 0; index < 12; ++index)
    with_gate += compose(backgrounds, stereo(), 5, index).valid_count > 0 ? 1 : 0;
  EXPECT_LE(with_gate, 2);
}

TEST(Backgrounds, AFrameOfFiveStaysAsItWasRecorded) {
  const Backgrounds backgrounds = room(8.0f);
  int untouched = 0;
  for (std::uint64_t index = 0; index < 200; ++index) {
    const Sample sample = compose(backgrounds, stereo(), 6, index);
    bool same = sample.gate_count == 0;
    for (std::size_t i = 0; same && i < sample.measured_mm.size(); ++i)
      same = sample.measured_mm[i] == static_cast<std::uint16_t>(1000.0f * backgrounds.measured_m[0][i] + 0.5f);
    untouched += same ? 1 : 0;
  }
  EXPECT_NEAR(untouched, 40, 17);
}

TEST(Backgrounds, GatesHaveTheSensorsEdges) {
  // Around a gate there are holes that the recording has not: the shadow on its left and the gap on its right.
  const Backgrounds backgrounds = room(8.0f);
  double holes = 0.0, gates = 0.0;
  for (std::uint64_t index = 0; index < 40; ++index) {
    const Sample sample = compose(backgrounds, stereo(), 7, index);
    if (sample.valid_count == 0) continue;
    gates += 1.0;
    for (std::size_t i = 0; i < sample.measured_mm.size(); ++i)
      holes += sample.measured_mm[i] == 0 && backgrounds.measured_m[0][i] > 0.0f ? 1.0 : 0.0;
  }
  EXPECT_GT(holes / gates, 50.0);
}

TEST(Backgrounds, ASampleFollowsFromSeedAndIndex) {
  const Backgrounds backgrounds = room(6.0f);
  EXPECT_EQ(compose(backgrounds, stereo(), 1, 3).measured_mm, compose(backgrounds, stereo(), 1, 3).measured_mm);
  EXPECT_NE(compose(backgrounds, stereo(), 1, 3).measured_mm, compose(backgrounds, stereo(), 2, 3).measured_mm);
}

using BackgroundFolder = FrameFolderFixture;

TEST_F(BackgroundFolder, ASetIsMadeAndRead) {
  put_camera(64, 36, 40.0);
  put_png("a.png", 64, 36, std::vector<float>(64 * 36, 6.0f));
  const auto frames = find_frames({folder_});
  ASSERT_TRUE(frames.ok()) << frames.error();
  const auto backgrounds = load_backgrounds(*frames);
  ASSERT_TRUE(backgrounds.ok()) << backgrounds.error();
  BackgroundOptions options;
  options.count = 20;
  options.threads = 2;
  options.noise = stereo();
  const Status made = generate_on_backgrounds(folder_ / "set.h5", *backgrounds, options);
  ASSERT_TRUE(made.ok()) << made.error();
  const auto set = Dataset::open(folder_ / "set.h5");
  ASSERT_TRUE(set.ok()) << set.error();
  ASSERT_EQ(set->size(), 20u);
  EXPECT_EQ(set->kind(), DatasetKind::kRecording);
  const Sample expected = compose(*backgrounds, options.noise, options.seed, 7);
  EXPECT_TRUE(std::ranges::equal(set->at(7).measured_mm, expected.measured_mm));
  EXPECT_EQ(set->at(7).valid_count, expected.valid_count);
}

}  // namespace
}  // namespace gatefield::training
