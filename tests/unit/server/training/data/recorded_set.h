#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>

#include "server/training/data/dataset.h"

/// A data set's file of the test's own, and recorded frames to put into it.
namespace gatefield::training {

class DatasetFileTest : public testing::Test {
 protected:
  DatasetFileTest() {
    std::string name = testing::UnitTest::GetInstance()->current_test_info()->name();
    std::ranges::replace(name, '/', '_');
    folder_ =
        std::filesystem::temp_directory_path() / ("gatefield_dataset_file_" + std::to_string(::getpid()) + "_" + name);
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
  }
  ~DatasetFileTest() override { std::filesystem::remove_all(folder_); }
  std::filesystem::path file() const { return folder_ / "set.h5"; }

  std::filesystem::path folder_;
};

inline std::string contents(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// A recorded frame whose every value follows from its number.
inline Sample numbered(std::uint32_t number) {
  Sample sample;
  sample.measured_mm.assign(kImageSize_px, static_cast<std::uint16_t>(1000 + number % 5000));
  sample.gate_count = 2;
  for (std::size_t g = 0; g < 2; ++g) {
    GateLabel& gate = sample.gates[g];
    gate.p_CG = Eigen::Vector3f(0.001f * static_cast<float>(number), g == 0 ? 0.5f : -0.25f, 2.0f);
    gate.q_CG = Eigen::Quaternionf(Eigen::AngleAxisf(0.001f * static_cast<float>(number), Eigen::Vector3f::UnitY()));
    gate.visible_fraction = g == 0 ? 0.75f : 0.1f;
    gate.shape.opening = g == 0 ? GateShape::Opening::kRound : GateShape::Opening::kSquare;
  }
  sample.X_WC = Eigen::Isometry3f(Eigen::Translation3f(static_cast<float>(number), 1.0f, 2.0f) *
                                  Eigen::AngleAxisf(0.3f, Eigen::Vector3f::UnitZ()));
  sample.sequence = number / 10;
  sample.time_s = 0.25 * number;
  sort_gates(&sample);
  return sample;
}

inline void expect_numbered(const SampleView& view, std::uint32_t number) {
  const Sample sample = numbered(number);
  ASSERT_TRUE(std::ranges::equal(view.measured_mm, sample.measured_mm)) << number;
  EXPECT_TRUE(view.clean_mm.empty());
  EXPECT_TRUE(view.surface.empty());
  ASSERT_EQ(view.gate_count, 2);
  ASSERT_EQ(view.valid_count, 1);
  for (std::size_t g = 0; g < 2; ++g) {
    EXPECT_EQ(view.gates[g].p_CG, sample.gates[g].p_CG);
    EXPECT_EQ(view.gates[g].q_CG.coeffs(), sample.gates[g].q_CG.coeffs());
    EXPECT_EQ(view.gates[g].visible_fraction, sample.gates[g].visible_fraction);
    EXPECT_EQ(view.gates[g].shape.opening, sample.gates[g].shape.opening);
  }
  ASSERT_TRUE(view.X_WC && view.sequence && view.time_s);
  EXPECT_TRUE(view.X_WC->isApprox(*sample.X_WC, 1e-6f));
  EXPECT_EQ(*view.sequence, number / 10);
  EXPECT_EQ(*view.time_s, 0.25 * number);
}

inline Result<DatasetWriter> open_recording(const std::filesystem::path& file) {
  return DatasetWriter::open(file, {.kind = DatasetKind::kRecording, .seed = 4, .note = "a note, für Menschen"},
                             {.X_WC = true, .sequence = true, .time = true});
}

}  // namespace gatefield::training
