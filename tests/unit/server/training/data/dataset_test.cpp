#include "server/training/data/dataset.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <numeric>

#include "common/scene/depth_camera.h"
#include "common/scene/world.h"
#include "server/training/data/contact_sheet.h"
#include "server/training/data/sampling.h"
#include "server/training/data/statistics.h"

namespace gatefield::training {
namespace {

/// A folder of its own that goes away with the test.
class DatasetFile : public testing::Test {
 protected:
  DatasetFile() {
    folder_ = std::filesystem::temp_directory_path() / ("gatefield_dataset_" + std::to_string(::getpid()) + "_" +
                                                        testing::UnitTest::GetInstance()->current_test_info()->name());
    std::filesystem::remove_all(folder_);
  }
  ~DatasetFile() override { std::filesystem::remove_all(folder_); }
  std::filesystem::path file() const { return folder_ / "cache" / "set.h5"; }

  std::filesystem::path folder_;
};

std::string contents(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

bool same(const SampleView& a, const SampleView& b) {
  if (!std::ranges::equal(a.clean_mm, b.clean_mm) || !std::ranges::equal(a.surface, b.surface)) return false;
  if (a.gate_count != b.gate_count || a.valid_count != b.valid_count) return false;
  for (std::size_t i = 0; i < static_cast<std::size_t>(a.gate_count); ++i) {
    if (a.gates[i].p_CG != b.gates[i].p_CG || a.gates[i].q_CG.coeffs() != b.gates[i].q_CG.coeffs() ||
        a.gates[i].visible_fraction != b.gates[i].visible_fraction ||
        static_cast<float>(a.gates[i].shape.thickness_m) != static_cast<float>(b.gates[i].shape.thickness_m))
      return false;
  }
  return true;
}

// --- Samples -----------------------------------------------------------------------------------------------------

TEST(Generate, DependsOnSeedAndIndexAlone) {
  const Sample sample = generate(3, 17);
  generate(3, 18);
  EXPECT_TRUE(same(generate(3, 17).view(), sample.view()));
  EXPECT_FALSE(same(generate(3, 18).view(), sample.view()));
  EXPECT_FALSE(same(generate(4, 17).view(), sample.view()));
}

TEST(Generate, CoversTheApproachVolume) {
  constexpr int kSamples = 1500;
  int none = 0;
  int several = 0;
  int near = 0;
  int middle = 0;
  int far = 0;
  int slanted = 0;
  int partial = 0;
  for (std::uint64_t i = 0; i < kSamples; ++i) {
    const Sample sample = generate(1, i);
    ASSERT_LE(sample.gate_count, kMaxGates);
    ASSERT_LE(sample.valid_count, sample.gate_count);
    none += sample.valid_count == 0 ? 1 : 0;
    several += sample.valid_count > 1 ? 1 : 0;
    const SampleView view = sample.view();
    const GateLabel* gate = view.target();
    if (gate == nullptr) continue;
    const float distance_m = gate->p_CG.norm();
    near += distance_m < 1.0f ? 1 : 0;
    middle += distance_m >= 1.0f && distance_m < 7.0f ? 1 : 0;
    far += distance_m >= 7.0f ? 1 : 0;
    partial += gate->visible_fraction < 0.7f ? 1 : 0;
    const float cosine = std::abs((gate->q_CG * Eigen::Vector3f::UnitX()).dot(gate->p_CG)) / distance_m;
    slanted += cosine < 0.5f ? 1 : 0;
  }
  EXPECT_NEAR(none / double{kSamples}, 0.225, 0.03);
  EXPECT_GT(several, 0.15 * kSamples);
  EXPECT_GT(near, 0.04 * kSamples);
  EXPECT_GT(middle, 0.5 * kSamples);
  EXPECT_GT(far, 0.04 * kSamples);
  EXPECT_GT(slanted, 0.15 * kSamples);  // more than 60 deg off the axis
  EXPECT_GT(partial, 0.10 * kSamples);
}

TEST(Generate, DrawsRoundGatesOnlyWhenAskedAndTheRestAsBefore) {
  const auto is_round = [](const GateLabel& gate) { return gate.shape.opening == GateShape::Opening::kRound; };
  int gates = 0, round = 0, same_view = 0;
  for (std::uint64_t i = 0; i < 300; ++i) {
    const Sample square = generate(5, i), mixed = generate(5, i, 0.5), all = generate(5, i, 1.0);
    ASSERT_EQ(square.gate_count, all.gate_count);
    for (int g = 0; g < square.gate_count; ++g) {
      const auto k = static_cast<std::size_t>(g);
      EXPECT_FALSE(is_round(square.gates[k]));
      EXPECT_TRUE(is_round(all.gates[k]));
      round += is_round(mixed.gates[k]) ? 1 : 0;
      ++gates;
    }
    same_view += square.X_WC->isApprox(*all.X_WC) ? 1 : 0;
  }
  EXPECT_NEAR(round, 0.5 * gates, 2.5 * std::sqrt(0.25 * gates));
  EXPECT_GT(same_view, 270);  // else a ring leaves room where a square does not, or the other way round
}

TEST(Generate, ValidGatesComeFirstAndNearestFirst) {
  for (std::uint64_t i = 0; i < 300; ++i) {
    const Sample sample = generate(2, i);
    for (int g = 0; g < sample.gate_count; ++g) {
      const GateLabel& gate = sample.gates[static_cast<std::size_t>(g)];
      EXPECT_EQ(gate.valid(), g < sample.valid_count);
      EXPECT_NEAR(gate.q_CG.norm(), 1.0f, 1e-5f);
      if (g == 0 || g >= sample.valid_count) continue;
      EXPECT_GE(gate.p_CG.norm(), sample.gates[static_cast<std::size_t>(g - 1)].p_CG.norm());
    }
  }
}

TEST(Generate, LabelsLieOnWhatTheImageShows) {
  // Pixels that the mask marks must be there for every valid gate, and cover about what its visible midline promises.
  std::vector<std::uint8_t> mask(kImageSize_px);
  int checked = 0;
  for (std::uint64_t i = 0; i < 300; ++i) {
    const Sample sample = generate(5, i);
    for (int g = 0; g < sample.valid_count; ++g) {
      const GateLabel& gate = sample.gates[static_cast<std::size_t>(g)];
      frame_mask(sample.view(), gate, mask);
      const int pixels = std::accumulate(mask.begin(), mask.end(), 0);
      EXPECT_GT(pixels, 3) << "sample " << i << " gate " << g << " visible " << gate.visible_fraction;
      ++checked;
    }
  }
  EXPECT_GT(checked, 200);
}

TEST(VisibleFraction, CountsWhatIsInTheImageAndNotHidden) {
  scene::World world;
  world.has_floor = false;
  scene::Gate gate;
  gate.X_WG.translation() = Eigen::Vector3d(3, 0, 0);
  world.gates.push_back(gate);
  const CameraModel& camera = dataset_camera();
  const auto fraction_seen = [&](const Eigen::Isometry3d& X_WC) {
    scene::DepthImage image;
    scene::DepthCamera(world).render(camera, X_WC, &image);
    std::vector<std::uint16_t> depth_mm;
    for (const float z : image.depth_m) depth_mm.push_back(static_cast<std::uint16_t>(z * 1000.0f + 0.5f));
    return visible_fraction(camera, depth_mm, gate.shape,
                            Eigen::Isometry3f(X_WC.inverse().cast<float>() * gate.X_WG.cast<float>()));
  };
  const Eigen::Isometry3d ahead = forward_camera_mount(0.0);
  EXPECT_FLOAT_EQ(fraction_seen(ahead), 1.0f);

  // Turned until the optical axis' right edge runs through the gate's middle: the left half remains.
  const Eigen::Isometry3d half(Eigen::AngleAxisd(43.5 * M_PI / 180.0, Eigen::Vector3d::UnitZ()) * ahead);
  EXPECT_NEAR(fraction_seen(half), 0.5f, 0.05f);

  // From the far side of the range nothing counts.
  Eigen::Isometry3d away = ahead;
  away.translation().x() = -8.0;
  EXPECT_FLOAT_EQ(fraction_seen(away), 0.0f);

  // A board before the left half hides it.
  scene::Box board;
  board.X_WO.translation() = Eigen::Vector3d(2, 1.0, 0);
  board.half_m = Eigen::Vector3d(0.02, 1.0, 2.0);
  world.boxes.push_back(board);
  EXPECT_NEAR(fraction_seen(ahead), 0.5f, 0.05f);
}

TEST(FrameMask, MarksTheFrameAndNothingElse) {
  for (std::uint64_t i = 0;; ++i) {
    const Sample sample = generate(6, i);
    const SampleView view = sample.view();
    const GateLabel* gate = view.target();
    if (gate == nullptr || gate->visible_fraction < 0.9f) continue;
    std::vector<std::uint8_t> mask(kImageSize_px);
    frame_mask(view, *gate, mask);
    const Eigen::Isometry3f X_GC = gate->X_CG().inverse();
    int marked = 0;
    for (int v = 0; v < kImageHeight_px; ++v) {
      for (int u = 0; u < kImageWidth_px; ++u) {
        const auto k = static_cast<std::size_t>(v * kImageWidth_px + u);
        if (mask[k] == 0) continue;
        ++marked;
        const Eigen::Vector3f p_C =
            dataset_camera().ray_C(u, v).cast<float>() * (0.001f * static_cast<float>(view.clean_mm[k]));
        const Eigen::Vector3d p_G = (X_GC * p_C).cast<double>();
        EXPECT_LE(std::abs(p_G.x()), 0.5 * gate->shape.thickness_m + 0.0301);
        EXPECT_GE(transverse_distance(gate->shape, p_G), 0.4699);
        EXPECT_LE(transverse_distance(gate->shape, p_G), 0.7801);
      }
    }
    EXPECT_GT(marked, 20);
    return;
  }
}

TEST(DrawNoisy, ScaleZeroGivesTheCleanImage) {
  const Sample sample = generate(1, 2);
  scene::SensorNoise noise;
  noise.scale = 0.0;
  Random random(1);
  std::vector<float> noisy(kImageSize_px);
  std::vector<float> clean(kImageSize_px);
  draw_noisy(sample.view(), noise, &random, noisy);
  draw_clean(sample.view(), clean);
  EXPECT_EQ(noisy, clean);
  for (std::size_t i = 0; i < kImageSize_px; ++i)
    ASSERT_FLOAT_EQ(clean[i], 0.001f * static_cast<float>(sample.clean_mm[i]));
}

TEST(DrawNoisy, EveryDrawDiffersAndEveryStreamRepeats) {
  const Sample sample = generate(1, 2);
  std::vector<float> first(kImageSize_px);
  std::vector<float> second(kImageSize_px);
  std::vector<float> again(kImageSize_px);
  Random random(1);
  draw_noisy(sample.view(), {}, &random, first);
  draw_noisy(sample.view(), {}, &random, second);
  Random restarted(1);
  draw_noisy(sample.view(), {}, &restarted, again);
  EXPECT_NE(first, second);
  EXPECT_EQ(first, again);
}

// --- Query points ------------------------------------------------------------------------------------------------

Eigen::Isometry3f some_pose() {
  Eigen::Isometry3f X_CG = Eigen::Isometry3f::Identity();
  X_CG.linear() =
      (Eigen::AngleAxisf(1.9f, Eigen::Vector3f::UnitY()) * Eigen::AngleAxisf(0.4f, Eigen::Vector3f::UnitX()))
          .toRotationMatrix();
  X_CG.translation() = Eigen::Vector3f(0.4f, -0.3f, 3.2f);
  return X_CG;
}

class SamplePoints : public testing::TestWithParam<GateShape::Opening> {
 protected:
  static constexpr std::size_t kPoints = 4000;
  SamplePoints() : points_C(3 * kPoints), sdf_m(kPoints) {
    shape.opening = GetParam();
    Random random(1);
    sample_points(mix, dataset_camera(), shape, X_CG, &random, points_C, sdf_m);
  }
  Eigen::Vector3f p_C(std::size_t i) const { return Eigen::Map<const Eigen::Vector3f>(points_C.data() + 3 * i); }
  Eigen::Vector3d p_G(std::size_t i) const { return (X_CG.inverse() * p_C(i)).cast<double>(); }

  SamplingMix mix{.near_surface = 0.4, .interior = 0.3, .collision = 0.2, .global = 0.1};
  GateShape shape;
  Eigen::Isometry3f X_CG = some_pose();
  std::vector<float> points_C;
  std::vector<float> sdf_m;
};

TEST_P(SamplePoints, TargetIsTheAnalyticField) {
  for (std::size_t i = 0; i < kPoints; ++i) ASSERT_NEAR(sdf_m[i], guide_sdf(shape, p_G(i)), 1e-5) << i;
}

TEST_P(SamplePoints, EachPartLiesWhereItShouldInItsShare) {
  double squares = 0.0;
  for (std::size_t i = 0; i < 1600; ++i) {
    ASSERT_LE(std::abs(p_G(i).x()), mix.reach_m + 1e-5);
    squares += sdf_m[i] * sdf_m[i];
  }
  EXPECT_NEAR(std::sqrt(squares / 1600), mix.near_sigma_m, 0.006);
  for (std::size_t i = 1600; i < 2800; ++i) {
    ASSERT_GE(sdf_m[i], -1e-5f);
    ASSERT_LE(std::abs(p_G(i).x()), mix.reach_m + 1e-5);
  }
  for (std::size_t i = 2800; i < 3600; ++i) {
    const Eigen::Vector3d p = p_G(i);
    ASSERT_LE(std::abs(p.x()), 0.5 * shape.thickness_m + mix.collision_margin_m + 1e-5);
    ASSERT_GE(transverse_distance(shape, p), shape.inner_half_m - mix.collision_margin_m - 1e-5);
    ASSERT_LE(transverse_distance(shape, p), shape.outer_half_m + mix.collision_margin_m + 1e-5);
  }
  double depth_m = 0.0;
  for (std::size_t i = 3600; i < kPoints; ++i) {
    ASSERT_TRUE(dataset_camera().sees(p_C(i).cast<double>(), -0.01)) << p_C(i).transpose();
    depth_m += p_C(i).z() / 400.0;
  }
  EXPECT_NEAR(depth_m, 5.15, 0.6);
}

TEST_P(SamplePoints, SidesAreEquallyLikely) {
  // Near-surface points: before and behind, left and right, above and below.
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < 1600; ++i) sum += p_G(i).cwiseSign();
  EXPECT_LT(sum.cwiseAbs().maxCoeff(), 5.0 * 40.0);  // five sigma
}

INSTANTIATE_TEST_SUITE_P(BothOpenings, SamplePoints,
                         testing::Values(GateShape::Opening::kSquare, GateShape::Opening::kRound),
                         [](const auto& test) {
                           return test.param == GateShape::Opening::kSquare ? "Square" : "Round";
                         });

TEST(SampleBox, FillsTheBoxInTheGatesFrame) {
  std::vector<float> points_C(3 * 2000);
  std::vector<float> sdf_m(2000);
  const GateShape shape;
  const Eigen::Isometry3f X_CG = some_pose();
  Random random(1);
  sample_box(1.0, shape, X_CG, &random, points_C, sdf_m);
  Eigen::Vector3d most = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < 2000; ++i) {
    const Eigen::Vector3d p_G =
        (X_CG.inverse() * Eigen::Vector3f(points_C[3 * i], points_C[3 * i + 1], points_C[3 * i + 2])).cast<double>();
    most = most.cwiseMax(p_G.cwiseAbs());
    ASSERT_NEAR(sdf_m[i], guide_sdf(shape, p_G), 1e-5);
  }
  EXPECT_LE(most.maxCoeff(), 1.0 + 1e-5);
  EXPECT_GE(most.minCoeff(), 0.99);
}

TEST(SamplingMixValidation, NamesTheField) {
  EXPECT_TRUE(validate(SamplingMix{}).ok());
  EXPECT_THAT(validate(SamplingMix{.interior = -0.1}).error(), testing::HasSubstr("sampling.interior"));
  EXPECT_THAT(validate(SamplingMix{.near_surface = 0, .interior = 0, .collision = 0, .global = 0}).error(),
              testing::HasSubstr("more than 0"));
  EXPECT_THAT(validate(SamplingMix{.reach_m = NAN}).error(), testing::HasSubstr("sampling.reach_m"));
}

// --- The file -----------------------------------------------------------------------------------------------------

TEST_F(DatasetFile, HoldsWhatGenerateGives) {
  Progress last;
  ASSERT_TRUE(generate_dataset(file(), {.seed = 8, .first_index = 100, .count = 20}, [&](const Progress& progress) {
                last = progress;
                return true;
              }).ok());
  EXPECT_EQ(last.done_n, 20u);
  EXPECT_EQ(last.total_n, 20u);
  EXPECT_GT(last.rate_hz, 0.0);
  const Result<Dataset> dataset = Dataset::open(file());
  ASSERT_TRUE(dataset.ok()) << dataset.error();
  ASSERT_EQ(dataset->size(), 20u);
  EXPECT_EQ(dataset->seed(), 8u);
  EXPECT_EQ(dataset->first_index(), 100u);
  for (const std::uint64_t i : {0u, 7u, 19u}) EXPECT_TRUE(same(dataset->at(i), generate(8, 100 + i).view())) << i;
}

TEST_F(DatasetFile, StoppedAndContinuedGivesTheSameBytes) {
  ASSERT_TRUE(generate_dataset(file(), {.seed = 8, .count = 300}).ok());
  const std::string whole = contents(file());
  std::filesystem::remove(file());
  ASSERT_TRUE(generate_dataset(file(), {.seed = 8, .count = 300}, [](const Progress&) { return false; }).ok());
  ASSERT_EQ(Dataset::open(file())->size(), 256u);
  ASSERT_TRUE(generate_dataset(file(), {.seed = 8, .count = 300, .threads = 1}).ok());
  EXPECT_TRUE(contents(file()) == whole);
}

TEST_F(DatasetFile, GrowsWhenMoreIsWanted) {
  ASSERT_TRUE(generate_dataset(file(), {.seed = 8, .count = 10}).ok());
  ASSERT_TRUE(generate_dataset(file(), {.seed = 8, .count = 140, .threads = 1}).ok());
  const Result<Dataset> dataset = Dataset::open(file());
  ASSERT_TRUE(dataset.ok()) << dataset.error();
  ASSERT_EQ(dataset->size(), 140u);
  for (const std::uint64_t i : {0u, 9u, 10u, 127u, 128u, 139u})
    EXPECT_TRUE(same(dataset->at(i), generate(8, i).view())) << i;
}

TEST_F(DatasetFile, StopsWhenAskedToAndKeepsWhatIsDone) {
  ASSERT_TRUE(generate_dataset(file(), {.seed = 8, .count = 600}, [](const Progress&) { return false; }).ok());
  const Result<Dataset> dataset = Dataset::open(file());
  ASSERT_TRUE(dataset.ok());
  ASSERT_EQ(dataset->size(), 256u);
  EXPECT_TRUE(same(dataset->at(255), generate(8, 255).view()));
}

TEST_F(DatasetFile, LeavesAFileThatIsLongEnough) {
  ASSERT_TRUE(generate_dataset(file(), {.seed = 8, .count = 5}).ok());
  const auto written = std::filesystem::last_write_time(file());
  ASSERT_TRUE(generate_dataset(file(), {.seed = 8, .count = 3}).ok());  // long enough already
  EXPECT_EQ(std::filesystem::last_write_time(file()), written);
  EXPECT_EQ(Dataset::open(file())->size(), 5u);
}

TEST_F(DatasetFile, RefusesAnotherSetsFile) {
  ASSERT_TRUE(generate_dataset(file(), {.seed = 8, .count = 1}).ok());
  const Status status = generate_dataset(file(), {.seed = 9, .count = 2});
  ASSERT_FALSE(status.ok());
  EXPECT_THAT(status.error(), testing::AllOf(testing::HasSubstr("seed 8"), testing::HasSubstr("seed 9")));
}

TEST_F(DatasetFile, RemembersItsPartOfRoundGates) {
  ASSERT_TRUE(generate_dataset(file(), {.seed = 8, .count = 3, .round_part = 0.5}).ok());
  const auto dataset = Dataset::open(file());
  ASSERT_TRUE(dataset.ok()) << dataset.error();
  EXPECT_EQ(dataset->info().round_part, 0.5);
  EXPECT_TRUE(same(dataset->at(2), generate(8, 2, 0.5).view()));
  EXPECT_THAT(generate_dataset(file(), {.seed = 8, .count = 4}).error(),
              testing::HasSubstr("has a part of 0.500000 round gates, expected 0.000000"));
}

TEST_F(DatasetFile, SaysWhatIsWrongWithAFile) {
  EXPECT_THAT(Dataset::open(file()).error(), testing::HasSubstr("can't be opened"));
  std::filesystem::create_directories(file().parent_path());
  std::ofstream(file()) << "short";
  EXPECT_THAT(Dataset::open(file()).error(), testing::HasSubstr("is not an HDF5 file"));
  EXPECT_FALSE(generate_dataset(file(), {.count = 1}).ok());
  std::ofstream(file()) << std::string(500, 'x');
  EXPECT_THAT(Dataset::open(file()).error(), testing::HasSubstr("is not an HDF5 file"));
  EXPECT_FALSE(generate_dataset(file(), {.count = 1}).ok());
  EXPECT_THAT(generate_dataset("/proc/nowhere/set.h5", {.count = 1}).error(), testing::HasSubstr("/proc/nowhere"));
}

TEST_F(DatasetFile, StatisticsShowWhatIsAskedOfASet) {
  ASSERT_TRUE(generate_dataset(file(), {.seed = 2, .count = 3000}).ok());
  const DatasetStatistics statistics = count_statistics(*Dataset::open(file()));
  EXPECT_EQ(statistics.frames, 3000u);
  EXPECT_NEAR(statistics.find("valid gates", "none").part(), 0.225, 0.025);
  EXPECT_GT(statistics.find("valid gates", "2").part(), 0.15);
  EXPECT_GT(statistics.find("two valid gates, difference of distance", "below 0.3 m").part(), 0.04);
  EXPECT_GT(statistics.find("side posts", "less than a pixel apart or overlapping").part(), 0.015);
  EXPECT_GT(statistics.find("angle off the gate's axis", "60 to 70 deg").part(), 0.08);
  EXPECT_GT(statistics.find("angle off the gate's axis", "70 to 80 deg").part(), 0.08);
  EXPECT_GT(statistics.find("part in view", "0.25 to 0.5").part(), 0.1);
  EXPECT_GT(statistics.find("roll of the body, either way", "45 to 60 deg").part(), 0.05);
  EXPECT_GT(statistics.find("pitch of the body, nose down", "30 to 45 deg").part(), 0.05);
  EXPECT_GT(statistics.find("around the gates", "frame of the wrong size in view").part(), 0.05);
  EXPECT_EQ(statistics.find("distance", "of the moon").of, 0u);
  EXPECT_THAT(to_text(statistics), testing::HasSubstr("two valid gates"));
}

TEST_F(DatasetFile, ContactSheetIsWritten) {
  ASSERT_TRUE(generate_dataset(file(), {.seed = 8, .count = 5}).ok());
  const Result<Dataset> dataset = Dataset::open(file());
  ASSERT_TRUE(dataset.ok());
  const auto png = folder_ / "pictures" / "sheet.png";
  const Status status = write_contact_sheet(*dataset, 8, {}, png);
  ASSERT_TRUE(status.ok()) << status.error();
  EXPECT_GT(std::filesystem::file_size(png), 10'000u);
  EXPECT_FALSE(write_contact_sheet(*dataset, 0, {}, png).ok());
  EXPECT_FALSE(write_contact_sheet(*dataset, 1, {}, "/proc/nowhere/sheet.png").ok());
}

}  // namespace
}  // namespace gatefield::training
