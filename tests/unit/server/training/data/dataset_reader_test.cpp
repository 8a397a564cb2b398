// Reading data sets' files that somebody else wrote.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <hdf5.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>

#include "server/training/data/dataset.h"
#include "tests/unit/server/training/data/recorded_set.h"

namespace gatefield::training {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using DatasetReading = DatasetFileTest;

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

TEST_F(DatasetReading, OtherTypesOfNumbersAreConverted) {
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

TEST_F(DatasetReading, VisibilityIsWorkedOutWhereItIsNotGiven) {
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

TEST_F(DatasetReading, SaysWhatIsWrongWithAForeignFile) {
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

TEST_F(DatasetReading, CompressedBeyondTheMemoryLimitIsRefused) {
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
