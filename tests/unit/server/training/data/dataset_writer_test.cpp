// Writing a data set's file, and what of it survives a kill.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <thread>

#include "server/training/data/dataset.h"
#include "tests/unit/server/training/data/recorded_set.h"

namespace gatefield::training {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using DatasetWriting = DatasetFileTest;

TEST_F(DatasetWriting, ReadsBackWhatWasAppended) {
  {
    auto writer = open_recording(file());
    ASSERT_TRUE(writer.ok()) << writer.error();
    for (std::uint32_t i = 0; i < 300; ++i) ASSERT_TRUE(writer.value().append(numbered(i)).ok());
    EXPECT_EQ(writer.value().count(), 300u);
    EXPECT_EQ(Dataset::open(file())->size(), 256u);  // while it is being written
    ASSERT_TRUE(writer.value().close().ok());
    EXPECT_FALSE(writer.value().append(numbered(300)).ok());
  }
  auto again = open_recording(file());
  ASSERT_TRUE(again.ok()) << again.error();
  EXPECT_EQ(again.value().count(), 300u);
  ASSERT_TRUE(again.value().append(numbered(300)).ok());
  ASSERT_TRUE(again.value().close().ok());

  const auto dataset = Dataset::open(file());
  ASSERT_TRUE(dataset.ok()) << dataset.error();
  EXPECT_EQ(dataset->kind(), DatasetKind::kRecording);
  EXPECT_EQ(dataset->seed(), 4u);
  EXPECT_EQ(dataset->info().note, "a note, für Menschen");
  EXPECT_TRUE(dataset->mapped());
  ASSERT_EQ(dataset->size(), 301u);
  for (std::uint32_t i = 0; i < 301; ++i) expect_numbered(dataset->at(i), i);

  // The measured image is what a network gets; there is no clean one.
  std::vector<float> depth_m(kImageSize_px);
  Random random(1);
  draw_noisy(dataset->at(7), {}, &random, depth_m);
  EXPECT_FLOAT_EQ(depth_m[99], 1.007f);
  draw_clean(dataset->at(7), depth_m);
  EXPECT_EQ(depth_m[99], 0.0f);
}

TEST_F(DatasetWriting, StereoHasBothImages) {
  auto writer = DatasetWriter::open(file(), {.kind = DatasetKind::kStereo});
  ASSERT_TRUE(writer.ok()) << writer.error();
  Sample sample = numbered(3);
  EXPECT_THAT(writer.value().append(sample).error(), AllOf(HasSubstr("clean_mm has 0 values"), HasSubstr("14400")));
  sample.clean_mm.assign(kImageSize_px, 2000);
  ASSERT_TRUE(writer.value().append(sample).ok());
  ASSERT_TRUE(writer.value().close().ok());
  const auto dataset = Dataset::open(file());
  ASSERT_TRUE(dataset.ok()) << dataset.error();
  const SampleView view = dataset->at(0);
  EXPECT_EQ(view.clean_mm[5], 2000);
  EXPECT_EQ(view.measured_mm[5], 1003);
  EXPECT_FALSE(view.X_WC || view.sequence || view.time_s);

  // Segmentation is judged by the clean image, or by the measured one where there is none.
  std::vector<std::uint8_t> clean_mask(kImageSize_px);
  std::vector<std::uint8_t> measured_mask(kImageSize_px);
  GateLabel gate;
  gate.p_CG = Eigen::Vector3f(0, 0, 2.0f);
  gate.q_CG = Eigen::Quaternionf(Eigen::AngleAxisf(-1.5707963f, Eigen::Vector3f::UnitY()));
  frame_mask(view, gate, clean_mask);
  SampleView recorded = view;
  recorded.clean_mm = {};
  frame_mask(recorded, gate, measured_mask);
  EXPECT_GT(std::ranges::count(clean_mask, 1), 100);
  EXPECT_EQ(std::ranges::count(measured_mask, 1), 0);
}

TEST_F(DatasetWriting, StoredPointsAreTheTargetsField) {
  ASSERT_TRUE(generate_dataset(file(), {.seed = 8, .count = 12, .points = 64}).ok());
  const auto dataset = Dataset::open(file());
  ASSERT_TRUE(dataset.ok()) << dataset.error();
  EXPECT_EQ(dataset->columns().points, 64);
  int with = 0;
  for (std::uint64_t i = 0; i < dataset->size(); ++i) {
    const SampleView view = dataset->at(i);
    ASSERT_EQ(view.points_C.size(), 192u);
    ASSERT_EQ(view.sdf_m.size(), 64u);
    const GateLabel* target = view.target();
    for (std::size_t k = 0; k < 64; ++k) {
      if (target == nullptr) {
        EXPECT_TRUE(std::isnan(view.sdf_m[k]));
        continue;
      }
      const Eigen::Vector3f p_C(view.points_C[3 * k], view.points_C[3 * k + 1], view.points_C[3 * k + 2]);
      const Eigen::Vector3d p_G = (target->X_CG().inverse() * p_C).cast<double>();
      EXPECT_NEAR(view.sdf_m[k], guide_sdf(target->shape, p_G), 1e-4);
      ++with;
    }
  }
  EXPECT_GT(with, 64);
  const Status other = generate_dataset(file(), {.seed = 8, .count = 20});
  EXPECT_THAT(other.error(), HasSubstr("64 stored points an image, expected 0"));
}

TEST_F(DatasetWriting, RefusesSamplesThatCantBe) {
  auto writer = open_recording(file());
  ASSERT_TRUE(writer.ok());
  const auto refused = [&](const std::function<void(Sample*)>& change) {
    Sample sample = numbered(1);
    change(&sample);
    const Status status = writer.value().append(sample);
    EXPECT_FALSE(status.ok());
    return status.error();
  };
  EXPECT_THAT(refused([](Sample* s) { s->measured_mm.pop_back(); }), HasSubstr("measured_mm has 14399 values"));
  EXPECT_THAT(refused([](Sample* s) { s->X_WC.reset(); }), HasSubstr("X_WC is missing"));
  EXPECT_THAT(refused([](Sample* s) { s->time_s = NAN; }), HasSubstr("time_s"));
  EXPECT_THAT(refused([](Sample* s) { s->gate_count = 5; }), HasSubstr("gate_count is 5, expected 0 to 4"));
  EXPECT_THAT(refused([](Sample* s) { s->valid_count = 2; }), HasSubstr("valid_count is 2, expected 1"));
  EXPECT_THAT(refused([](Sample* s) { s->gates[1].p_CG.x() = INFINITY; }), HasSubstr("gate 1: p_CG is inf"));
  EXPECT_THAT(refused([](Sample* s) { s->gates[0].q_CG.w() = 3.0f; }), HasSubstr("gate 0: the norm of q_CG"));
  EXPECT_THAT(refused([](Sample* s) { s->gates[0].shape.outer_half_m = 0.2; }), HasSubstr("outer_half_m is 0.2"));
  EXPECT_EQ(writer.value().count(), 0u);
}

TEST_F(DatasetWriting, RefusesToContinueAnotherSet) {
  ASSERT_TRUE(open_recording(file()).value().close().ok());
  const auto error = [&](const DatasetInfo& info, const DatasetColumns& columns) {
    return DatasetWriter::open(file(), info, columns).error();
  };
  const DatasetColumns columns{.X_WC = true, .sequence = true, .time = true};
  EXPECT_THAT(error({.kind = DatasetKind::kStereo, .seed = 4}, columns),
              HasSubstr("is of kind 'recording', expected 'stereo'"));
  EXPECT_THAT(error({.kind = DatasetKind::kRecording, .seed = 5}, columns), HasSubstr("seed 4 from index 0, expected"));
  EXPECT_THAT(error({.kind = DatasetKind::kRecording, .seed = 4}, {}), HasSubstr("/X_WC is there, but is not written"));
  EXPECT_THAT(error({.kind = DatasetKind::kRecording, .seed = 4}, {.X_WC = true, .sequence = true, .points = 3}),
              HasSubstr("0 stored points an image, expected 3"));
  const auto first = open_recording(file());
  ASSERT_TRUE(first.ok());
  EXPECT_THAT(open_recording(file()).error(), HasSubstr("is being written by another process"));
}

// --- Killed -------------------------------------------------------------------------------------------------------

/// Runs `work` in a process that is killed after `lifetime`; true when it ended by itself, well.
bool run_and_kill(std::chrono::microseconds lifetime, const std::function<bool()>& work) {
  const pid_t child = ::fork();
  if (child == 0) ::_exit(work() ? 0 : 1);
  int status = 0;
  const auto end = std::chrono::steady_clock::now() + lifetime;
  while (::waitpid(child, &status, WNOHANG) == 0) {
    if (std::chrono::steady_clock::now() >= end) ::kill(child, SIGKILL);
    ::usleep(500);
  }
  EXPECT_TRUE(WIFSIGNALED(status) || WEXITSTATUS(status) == 0) << "the work itself failed";
  return WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

TEST_F(DatasetWriting, KilledGenerationContinuesToTheSameBytes) {
  const DatasetOptions options{.seed = 8, .count = 700, .threads = 1};
  ASSERT_TRUE(generate_dataset(folder_ / "whole.h5", options).ok());
  Random random(1);
  std::uint32_t kills = 0;
  // Longer and longer lives, so that it comes to an end on a busy machine too.
  while (!run_and_kill(std::chrono::microseconds(20'000 + random.below(50'000 * (2 + kills))),
                       [&] { return generate_dataset(file(), options).ok(); })) {
    ++kills;
    if (!std::filesystem::exists(file()) || std::filesystem::exists(file().string() + ".journal")) continue;
    const auto dataset = Dataset::open(file());
    ASSERT_TRUE(dataset.ok()) << dataset.error();
    // Whole blocks, or everything: it may be killed after its last write, too.
    EXPECT_TRUE(dataset->size() % 256 == 0 || dataset->size() == options.count) << dataset->size();
  }
  EXPECT_GT(kills, 1u);
  EXPECT_TRUE(contents(file()) == contents(folder_ / "whole.h5"));
}

TEST_F(DatasetWriting, KilledWhileGrowingKeepsEverySample) {
  // Dies while HDF5 changes the file's structure: the journal is there from before until after that.
  const std::filesystem::path journal = file().string() + ".journal";
  Random random(2);
  int repaired = 0;
  std::uint32_t before = 0;
  for (int round = 0; round < 25; ++round) {
    const std::chrono::microseconds wait(random.below(1500));
    run_and_kill(std::chrono::seconds(5), [&] {
      std::jthread([&] {
        while (::access(journal.c_str(), F_OK) != 0) std::this_thread::yield();
        for (const auto end = std::chrono::steady_clock::now() + wait; std::chrono::steady_clock::now() < end;)
          continue;
        ::kill(::getpid(), SIGKILL);
      }).detach();
      auto writer = open_recording(file());
      if (!writer.ok()) return false;
      for (std::uint64_t more = 1;; ++more) {
        if (!writer.value().append(numbered(static_cast<std::uint32_t>(writer->count()))).ok()) return false;
        if (!writer.value().flush().ok() || !writer.value().reserve(writer->count() + 200 * more).ok()) return false;
      }
    });
    ASSERT_TRUE(std::filesystem::exists(file()));
    if (std::filesystem::exists(journal)) {
      ++repaired;
      // HDF5 writes its structure within a fraction of a millisecond; make sure that some of it is really broken.
      std::fstream(file(), std::ios::in | std::ios::out | std::ios::binary) << std::string(1000, 'x');
      EXPECT_THAT(Dataset::open(file()).error(), HasSubstr("repeat the command"));
    }
    {
      auto writer = open_recording(file());
      ASSERT_TRUE(writer.ok()) << writer.error();
      ASSERT_GE(writer->count(), before);
      ASSERT_TRUE(writer.value().append(numbered(static_cast<std::uint32_t>(writer->count()))).ok());
      ASSERT_TRUE(writer.value().flush().ok());
      before = static_cast<std::uint32_t>(writer->count());
    }
    const auto dataset = Dataset::open(file());
    ASSERT_TRUE(dataset.ok()) << dataset.error();
    ASSERT_EQ(dataset->size(), before);
    for (std::uint32_t i = 0; i < before; ++i) {
      expect_numbered(dataset->at(i), i);
      ASSERT_FALSE(HasFatalFailure());
    }
  }
  EXPECT_GT(repaired, 5);
  EXPECT_GE(before, 25u);
}

}  // namespace
}  // namespace gatefield::training
