// The HDF5 file: what survives a kill, and files that somebody else wrote.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <hdf5.h>
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

namespace gatefield::training {
namespace {

using testing::AllOf;
using testing::HasSubstr;

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

std::string contents(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// A recorded frame whose every value follows from its number.
Sample numbered(std::uint32_t number) {
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

void expect_numbered(const SampleView& view, std::uint32_t number) {
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

Result<DatasetWriter> open_recording(const std::filesystem::path& file) {
  return DatasetWriter::open(file, {.kind = DatasetKind::kRecording, .seed = 4, .note = "a note, für Menschen"},
                             {.X_WC = true, .sequence = true, .time = true});
}

// --- Writing and reading back ---------------------------------------------------------------------------------------

TEST_F(DatasetFileTest, ReadsBackWhatWasAppended) {
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

TEST_F(DatasetFileTest, StereoHasBothImages) {
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

TEST_F(DatasetFileTest, StoredPointsAreTheTargetsField) {
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

TEST_F(DatasetFileTest, RefusesSamplesThatCantBe) {
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

TEST_F(DatasetFileTest, RefusesToContinueAnotherSet) {
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

TEST_F(DatasetFileTest, KilledGenerationContinuesToTheSameBytes) {
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

TEST_F(DatasetFileTest, KilledWhileGrowingKeepsEverySample) {
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

// --- Files that somebody else wrote
// -----------------------------------------------------------------------------------

void text_attribute(hid_t object, const char* name, const std::string& value) {
  const hid_t type = H5Tcopy(H5T_C_S1);  // of fixed length, as not every writer does it like ours
  H5Tset_size(type, std::max<std::size_t>(value.size(), 1));
  const hid_t space = H5Screate(H5S_SCALAR);
  if (H5Aexists(object, name) > 0) H5Adelete(object, name);
  const hid_t attribute = H5Acreate2(object, name, type, space, H5P_DEFAULT, H5P_DEFAULT);
  H5Awrite(attribute, type, value.data());
  H5Aclose(attribute);
  H5Sclose(space);
  H5Tclose(type);
}

void number_attribute(hid_t object, const char* name, double value) {
  const hid_t space = H5Screate(H5S_SCALAR);
  if (H5Aexists(object, name) > 0) H5Adelete(object, name);
  const bool whole = value == std::floor(value);
  const hid_t attribute =
      H5Acreate2(object, name, whole ? H5T_STD_I64LE : H5T_IEEE_F64LE, space, H5P_DEFAULT, H5P_DEFAULT);
  H5Awrite(attribute, H5T_NATIVE_DOUBLE, &value);
  H5Aclose(attribute);
  H5Sclose(space);
}

enum class Storage { kContiguous, kCompressed, kAcrossImages, kWholeImages };

template <typename T>
void write_dataset(hid_t file, const char* name, hid_t stored, hid_t memory, std::vector<hsize_t> sizes,
                   const std::vector<T>& values, Storage storage = Storage::kContiguous) {
  if (H5Lexists(file, name, H5P_DEFAULT) > 0) H5Ldelete(file, name, H5P_DEFAULT);
  const hid_t space = H5Screate_simple(static_cast<int>(sizes.size()), sizes.data(), nullptr);
  const hid_t properties = H5Pcreate(H5P_DATASET_CREATE);
  if (storage != Storage::kContiguous) {
    auto chunk = sizes;
    chunk[0] = std::min<hsize_t>(2, sizes[0]);
    if (storage == Storage::kAcrossImages && chunk.size() > 1) chunk[1] = (chunk[1] + 1) / 2;
    H5Pset_chunk(properties, static_cast<int>(chunk.size()), chunk.data());
    if (storage == Storage::kCompressed) H5Pset_deflate(properties, 4);
  }
  const hid_t dataset = H5Dcreate2(file, name, stored, space, H5P_DEFAULT, properties, H5P_DEFAULT);
  H5Dwrite(dataset, memory, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data());
  H5Dclose(dataset);
  H5Pclose(properties);
  H5Sclose(space);
}

constexpr std::uint64_t kFrames = 5;

std::vector<float> gate_values() {
  std::vector<float> values(kFrames * 4 * 12, 0.0f);
  for (std::size_t i = 0; i < kFrames; ++i) {
    const float gate[12] = {
        0.1f * static_cast<float>(i), 0.2f, 2.0f, 1.0f, 0.0f, 0.0f, 0.0f, 0.5f, 0.5f, 0.75f, 0.06f, 0.0f};
    std::copy_n(gate, 12, values.begin() + static_cast<std::ptrdiff_t>(i * 48));
  }
  return values;
}

/// A recording of five frames with one gate each, as somebody else would write it; `change` spoils it.
void write_foreign(
    const std::filesystem::path& path, Storage storage, const std::function<void(hid_t)>& change = [](hid_t) {}) {
  const hid_t file = H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
  ASSERT_GE(file, 0);
  text_attribute(file, "format", "gatefield-dataset");
  text_attribute(file, "kind", "recording");
  for (const auto& [name, value] : {std::pair{"version", 2.0}, {"seed", 0.0}, {"first_index", 0.0}})
    number_attribute(file, name, value);
  const hid_t group = H5Gcreate2(file, "camera", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
  const CameraModel& camera = dataset_camera();
  for (const auto& [name, value] : {std::pair<const char*, double>{"width_px", 160.0},
                                    {"height_px", 90.0},
                                    {"fx_px", camera.fx_px},
                                    {"fy_px", camera.fy_px},
                                    {"cx_px", camera.cx_px},
                                    {"cy_px", camera.cy_px},
                                    {"min_depth_m", camera.min_depth_m},
                                    {"max_depth_m", camera.max_depth_m}})
    number_attribute(group, name, value);
  H5Gclose(group);
  std::vector<std::uint16_t> depth_mm(kFrames * kImageSize_px);
  for (std::size_t i = 0; i < depth_mm.size(); ++i)
    depth_mm[i] = static_cast<std::uint16_t>(1000 * (i / kImageSize_px) + i % 7);
  write_dataset(file, "depth_mm", H5T_STD_U16LE, H5T_NATIVE_UINT16, {kFrames, 90, 160}, depth_mm, storage);
  write_dataset(file, "gates", H5T_IEEE_F32LE, H5T_NATIVE_FLOAT, {kFrames, 4, 12}, gate_values(), storage);
  write_dataset(file, "gate_count", H5T_STD_I32LE, H5T_NATIVE_INT32, {kFrames}, std::vector<std::int32_t>(kFrames, 1));
  change(file);
  H5Fclose(file);
}

class ForeignFile : public DatasetFileTest, public testing::WithParamInterface<Storage> {};

TEST_P(ForeignFile, IsRead) {
  write_foreign(file(), GetParam());
  const auto dataset = Dataset::open(file());
  ASSERT_TRUE(dataset.ok()) << dataset.error();
  EXPECT_EQ(dataset->mapped(), GetParam() == Storage::kContiguous || GetParam() == Storage::kWholeImages);
  ASSERT_EQ(dataset->size(), kFrames);
  for (std::uint64_t i = 0; i < kFrames; ++i) {
    const SampleView view = dataset->at(i);
    for (std::size_t k = 0; k < kImageSize_px; ++k)
      ASSERT_EQ(view.measured_mm[k], 1000 * i + (i * kImageSize_px + k) % 7);
    ASSERT_EQ(view.valid_count, 1);
    EXPECT_FLOAT_EQ(view.gates[0].p_CG.x(), 0.1f * static_cast<float>(i));
  }
  EXPECT_FALSE(DatasetWriter::open(file(), {.kind = DatasetKind::kRecording}).ok());  // can be read, not continued
}

const char* name_of(Storage storage) {
  switch (storage) {
    case Storage::kContiguous:
      return "Contiguous";
    case Storage::kCompressed:
      return "Compressed";
    case Storage::kAcrossImages:
      return "AcrossImages";
    case Storage::kWholeImages:
      return "WholeImages";
  }
  return "";
}

INSTANTIATE_TEST_SUITE_P(Storages, ForeignFile,
                         testing::Values(Storage::kContiguous, Storage::kCompressed, Storage::kAcrossImages,
                                         Storage::kWholeImages),
                         [](const auto& test) { return name_of(test.param); });

TEST_F(DatasetFileTest, OtherTypesOfNumbersAreConverted) {
  write_foreign(file(), Storage::kContiguous, [](hid_t h5) {
    const std::vector<float> values = gate_values();
    write_dataset(h5, "gates", H5T_IEEE_F64LE, H5T_NATIVE_FLOAT, {kFrames, 4, 12}, values);
    write_dataset(h5, "gate_count", H5T_STD_I64BE, H5T_NATIVE_INT32, {kFrames}, std::vector<std::int32_t>(kFrames, 1));
  });
  const auto dataset = Dataset::open(file());
  ASSERT_TRUE(dataset.ok()) << dataset.error();
  EXPECT_FALSE(dataset->mapped());
  EXPECT_FLOAT_EQ(dataset->at(4).gates[0].p_CG.x(), 0.4f);
}

TEST_F(DatasetFileTest, VisibilityIsWorkedOutWhereItIsNotGiven) {
  // Looking straight at a gate of which only the left half was painted into the image.
  write_foreign(file(), Storage::kContiguous, [](hid_t h5) {
    std::vector<float> gates = gate_values();
    for (std::size_t i = 0; i < kFrames; ++i) {
      const float q = std::sqrt(0.5f);
      const float gate[12] = {0, 0, 2.0f, q, 0, -q, 0, -1.0f, 0.5f, 0.75f, 0.06f, 0};
      std::copy_n(gate, 12, gates.begin() + static_cast<std::ptrdiff_t>(i * 48));
    }
    std::vector<std::uint16_t> depth_mm(kFrames * kImageSize_px, 0);
    for (std::size_t k = 0; k < depth_mm.size(); ++k) depth_mm[k] = k % 160 < 80 ? 2000 : 0;
    write_dataset(h5, "gates", H5T_IEEE_F32LE, H5T_NATIVE_FLOAT, {kFrames, 4, 12}, gates);
    write_dataset(h5, "depth_mm", H5T_STD_U16LE, H5T_NATIVE_UINT16, {kFrames, 90, 160}, depth_mm);
  });
  const auto dataset = Dataset::open(file());
  ASSERT_TRUE(dataset.ok()) << dataset.error();
  EXPECT_FLOAT_EQ(dataset->at(2).gates[0].visible_fraction, 0.5f);
  EXPECT_EQ(dataset->at(2).valid_count, 1);
}

TEST_F(DatasetFileTest, SaysWhatIsWrongWithAForeignFile) {
  const auto error = [&](const std::function<void(hid_t)>& change) -> std::string {
    write_foreign(file(), Storage::kContiguous, change);
    const auto dataset = Dataset::open(file());
    EXPECT_FALSE(dataset.ok());
    return dataset.ok() ? "" : dataset.error();
  };
  const auto gates = [](std::size_t at, float value) {
    return [=](hid_t h5) {
      std::vector<float> values = gate_values();
      values[at] = value;
      write_dataset(h5, "gates", H5T_IEEE_F32LE, H5T_NATIVE_FLOAT, {kFrames, 4, 12}, values);
    };
  };
  const auto counts = [](const char* name, std::int32_t value) {
    return [=](hid_t h5) {
      std::vector<std::int32_t> values(kFrames, 1);
      values[3] = value;
      write_dataset(h5, name, H5T_STD_I32LE, H5T_NATIVE_INT32, {kFrames}, values);
    };
  };
  EXPECT_THAT(error([](hid_t h5) { H5Adelete(h5, "format"); }),
              AllOf(HasSubstr(file().string()), HasSubstr("attribute format is missing")));
  EXPECT_THAT(error([](hid_t h5) { text_attribute(h5, "format", "other"); }),
              HasSubstr("format is 'other', expected 'gatefield-dataset'"));
  EXPECT_THAT(error([](hid_t h5) { number_attribute(h5, "version", 3); }), HasSubstr("has version 3, expected 2"));
  EXPECT_THAT(error([](hid_t h5) { text_attribute(h5, "version", "2"); }),
              HasSubstr("version can't be read as a whole number"));
  EXPECT_THAT(error([](hid_t h5) { text_attribute(h5, "kind", "film"); }),
              HasSubstr("kind is 'film', expected 'simulation', 'stereo' or 'recording'"));
  EXPECT_THAT(error([](hid_t h5) { text_attribute(h5, "kind", "stereo"); }), HasSubstr("/clean_mm is missing"));
  EXPECT_THAT(error([](hid_t h5) { H5Ldelete(h5, "camera", H5P_DEFAULT); }), HasSubstr("/camera is missing"));
  EXPECT_THAT(error([](hid_t h5) {
                const hid_t camera = H5Gopen2(h5, "camera", H5P_DEFAULT);
                number_attribute(camera, "fx_px", 200.5);
                H5Gclose(camera);
              }),
              AllOf(HasSubstr("/camera.fx_px is 200.5"), HasSubstr("expected 84.")));
  EXPECT_THAT(error([](hid_t h5) {
                write_dataset(h5, "depth_mm", H5T_STD_U16LE, H5T_NATIVE_UINT16, {kFrames, 90, 161},
                              std::vector<std::uint16_t>(kFrames * 90 * 161));
              }),
              HasSubstr("/depth_mm has shape [5, 90, 161], expected [N, 90, 160]"));
  EXPECT_THAT(error([](hid_t h5) {
                write_dataset(h5, "depth_mm", H5T_IEEE_F32LE, H5T_NATIVE_FLOAT, {kFrames, 90, 160},
                              std::vector<float>(kFrames * kImageSize_px));
              }),
              HasSubstr("/depth_mm holds something else, expected whole numbers"));
  EXPECT_THAT(error([](hid_t h5) {
                write_dataset(h5, "gate_count", H5T_STD_I32LE, H5T_NATIVE_INT32, {4}, std::vector<std::int32_t>(4));
              }),
              HasSubstr("/gate_count has 4 frames, expected 5 as the others"));
  EXPECT_THAT(error([](hid_t h5) {
                write_dataset(h5, "written", H5T_STD_U64LE, H5T_NATIVE_UINT64, {1}, std::vector<std::uint64_t>{6});
              }),
              HasSubstr("/written is 6, expected at most the 5 frames"));
  EXPECT_THAT(error(counts("gate_count", 7)), HasSubstr("/gate_count[3]: is 7, expected 0 to 4"));
  EXPECT_THAT(error(counts("valid_count", 0)), HasSubstr("/valid_count[3]: is 0, expected 1"));
  EXPECT_THAT(error(gates(2 * 48 + 1, NAN)), HasSubstr("/gates[2]: gate 0: p_CG is nan, expected finite metres"));
  EXPECT_THAT(error(gates(2 * 48 + 3, 1.5f)), HasSubstr("/gates[2]: gate 0: the norm of q_CG is 1.5"));
  EXPECT_THAT(error(gates(2 * 48 + 7, 1.5f)), HasSubstr("visible_fraction is 1.5"));
  EXPECT_THAT(error(gates(2 * 48 + 9, 0.4f)), HasSubstr("outer_half_m is 0.4"));
  EXPECT_THAT(error(gates(2 * 48 + 11, 2.0f)), HasSubstr("opening is 2"));
  EXPECT_THAT(error([](hid_t h5) {
                std::vector<float> poses(kFrames * 7, 0.0f);
                write_dataset(h5, "X_WC", H5T_IEEE_F32LE, H5T_NATIVE_FLOAT, {kFrames, 7}, poses);
              }),
              HasSubstr("/X_WC[0]: the norm of q_WC is 0"));

  write_foreign(file(), Storage::kContiguous);
  std::filesystem::resize_file(file(), std::filesystem::file_size(file()) / 2);
  EXPECT_THAT(Dataset::open(file()).error(), HasSubstr("truncated"));
  write_foreign(file(), Storage::kContiguous);
  std::ofstream(file().string() + ".journal") << "nonsense, and more of it";
  EXPECT_THAT(open_recording(file()).error(), HasSubstr("is no journal of a data set"));
}

TEST_F(DatasetFileTest, CompressedBeyondTheMemoryLimitIsRefused) {
  // 160,000 compressed images of zeros: a file of almost nothing that would take 4.6 GB.
  constexpr hsize_t kMany = 160'000;
  write_foreign(file(), Storage::kContiguous, [](hid_t h5) {
    H5Ldelete(h5, "depth_mm", H5P_DEFAULT);
    const hsize_t sizes[3] = {kMany, 90, 160};
    const hsize_t chunk[3] = {8, 90, 160};
    const hid_t space = H5Screate_simple(3, sizes, nullptr);
    const hid_t properties = H5Pcreate(H5P_DATASET_CREATE);
    H5Pset_chunk(properties, 3, chunk);
    H5Pset_deflate(properties, 1);
    H5Dclose(H5Dcreate2(h5, "depth_mm", H5T_STD_U16LE, space, H5P_DEFAULT, properties, H5P_DEFAULT));
    H5Pclose(properties);
    H5Sclose(space);
    write_dataset(h5, "gates", H5T_IEEE_F32LE, H5T_NATIVE_FLOAT, {kMany, 4, 12}, std::vector<float>(kMany * 48));
    write_dataset(h5, "gate_count", H5T_STD_I32LE, H5T_NATIVE_INT32, {kMany}, std::vector<std::int32_t>(kMany));
  });
  EXPECT_THAT(Dataset::open(file()).error(),
              AllOf(HasSubstr("/depth_mm is compressed"), HasSubstr("expected at most 4096"), HasSubstr("h5repack")));
}

}  // namespace
}  // namespace gatefield::training
