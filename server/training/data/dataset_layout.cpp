#include "server/training/data/dataset_layout.h"

#include <hdf5.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <string>
#include <utility>

#include "server/training/data/hdf5_attributes.h"
#include "server/training/data/hdf5_library.h"

namespace gatefield::training {
namespace {

using hdf5::Handle;
using hdf5::Library;
using hdf5::read_number;
using hdf5::read_text;
using hdf5::read_whole;
using hdf5::reason;
using hdf5::write_f64;
using hdf5::write_i32;
using hdf5::write_text;
using hdf5::write_u64;

constexpr const char* kFormat = "gatefield-dataset";
constexpr std::int64_t kVersion = 2;  ///< raise when the schema changes
constexpr std::size_t kChunkBytes = std::size_t{4} << 20;
constexpr std::uint64_t kMaxChunkFrames = 4096;
/// Chunks of more than this start at a page, so that mapped images are aligned.
constexpr hsize_t kAlignFrom_bytes = 64 << 10;
constexpr hsize_t kPage_bytes = 4096;
constexpr const char* kGateColumns =
    "p_CG_x p_CG_y p_CG_z q_CG_w q_CG_x q_CG_y q_CG_z visible_fraction inner_half_m outer_half_m thickness_m opening";

hid_t stored_type(Element element) {
  switch (element) {
    case Element::kU8:
      return H5T_STD_U8LE;
    case Element::kU16:
      return H5T_STD_U16LE;
    case Element::kI32:
      return H5T_STD_I32LE;
    case Element::kU32:
      return H5T_STD_U32LE;
    case Element::kF32:
      return H5T_IEEE_F32LE;
    case Element::kF64:
      return H5T_IEEE_F64LE;
  }
  return -1;
}

hid_t native_type(Element element) {
  switch (element) {
    case Element::kU8:
      return H5T_NATIVE_UINT8;
    case Element::kU16:
      return H5T_NATIVE_UINT16;
    case Element::kI32:
      return H5T_NATIVE_INT32;
    case Element::kU32:
      return H5T_NATIVE_UINT32;
    case Element::kF32:
      return H5T_NATIVE_FLOAT;
    case Element::kF64:
      return H5T_NATIVE_DOUBLE;
  }
  return -1;
}

const char* words(Element element) {
  return element == Element::kF32 || element == Element::kF64 ? "floating-point numbers" : "whole numbers";
}

std::string dimensions(const std::vector<hsize_t>& sizes, const char* first) {
  std::string text = "[";
  for (std::size_t i = 0; i < sizes.size(); ++i) {
    if (i > 0) text += ", ";
    text += i == 0 && first != nullptr ? first : std::to_string(sizes[i]);
  }
  return text + "]";
}

Handle access_properties() {
  Handle properties(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  H5Pset_alignment(properties, kAlignFrom_bytes, kPage_bytes);
  // Our own lock keeps a second writer out; readers may come at any time.
  H5Pset_file_locking(properties, false, true);
  return properties;
}

Handle open_file(const std::filesystem::path& file, unsigned flags) {
  const Handle access = access_properties();
  return {H5Fopen(file.c_str(), flags, access), H5Fclose};
}

// --- Camera -------------------------------------------------------------------------------------------------------

struct CameraValue {
  const char* name;
  double value;
};
std::array<CameraValue, 8> camera_values() {
  const CameraModel& camera = dataset_camera();
  return {{{"width_px", static_cast<double>(camera.width_px)},
           {"height_px", static_cast<double>(camera.height_px)},
           {"fx_px", camera.fx_px},
           {"fy_px", camera.fy_px},
           {"cx_px", camera.cx_px},
           {"cy_px", camera.cy_px},
           {"min_depth_m", camera.min_depth_m},
           {"max_depth_m", camera.max_depth_m}}};
}

Status check_camera(const std::filesystem::path& file, hid_t root) {
  const Handle camera(H5Lexists(root, "camera", H5P_DEFAULT) > 0 ? H5Oopen(root, "camera", H5P_DEFAULT) : -1, H5Oclose);
  if (!camera.ok()) return file_error(file, "group /camera is missing");
  for (const CameraValue& expected : camera_values()) {
    const auto value = read_number(file, camera, "/camera.", expected.name);
    if (!value) return value.failure();
    if (!(std::abs(*value - expected.value) <= 1e-3 * std::max(1.0, std::abs(expected.value)))) {
      return file_error(file, std::string("/camera.") + expected.name + " is " + std::to_string(*value) +
                                  ", expected " + std::to_string(expected.value) +
                                  " (images of another camera are resampled by gatefield-train import)");
    }
  }
  return {};
}

// --- Data sets ----------------------------------------------------------------------------------------------------

bool create_column(hid_t file, const ColumnShape& shape) {
  std::vector<hsize_t> sizes{0};
  std::vector<hsize_t> largest{H5S_UNLIMITED};
  std::vector<hsize_t> chunk{
      std::clamp<std::uint64_t>(std::bit_floor(kChunkBytes / shape.frame_bytes()), 1, kMaxChunkFrames)};
  for (const std::uint64_t size : shape.frame) {
    sizes.push_back(size);
    largest.push_back(size);
    chunk.push_back(size);
  }
  const auto rank = static_cast<int>(sizes.size());
  const Handle space(H5Screate_simple(rank, sizes.data(), largest.data()), H5Sclose);
  const Handle properties(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
  H5Pset_chunk(properties, rank, chunk.data());
  // All room is taken at once and left as it is: it is filled with pwrite(), and stays a hole until then.
  H5Pset_alloc_time(properties, H5D_ALLOC_TIME_EARLY);
  H5Pset_fill_time(properties, H5D_FILL_TIME_NEVER);
  H5Pset_obj_track_times(properties, false);
  const Handle dataset(
      H5Dcreate2(file, shape.name, stored_type(shape.element), space, H5P_DEFAULT, properties, H5P_DEFAULT), H5Dclose);
  return dataset.ok() && (std::string(shape.name) != "gates" || write_text(dataset, "columns", kGateColumns));
}

/// Room for the number of whole samples: not an attribute, since only a data set's place in the file can be asked for.
bool create_written(hid_t file) {
  const Handle space(H5Screate(H5S_SCALAR), H5Sclose);
  const Handle properties(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
  H5Pset_layout(properties, H5D_CONTIGUOUS);
  H5Pset_alloc_time(properties, H5D_ALLOC_TIME_EARLY);
  H5Pset_obj_track_times(properties, false);
  const Handle dataset(H5Dcreate2(file, "written", H5T_STD_U64LE, space, H5P_DEFAULT, properties, H5P_DEFAULT),
                       H5Dclose);
  const std::uint64_t none = 0;
  return dataset.ok() && H5Dwrite(dataset, H5T_NATIVE_UINT64, H5S_ALL, H5S_ALL, H5P_DEFAULT, &none) >= 0;
}

bool create_camera(hid_t file) {
  const Handle properties(H5Pcreate(H5P_GROUP_CREATE), H5Pclose);
  H5Pset_obj_track_times(properties, false);
  const Handle group(H5Gcreate2(file, "camera", H5P_DEFAULT, properties, H5P_DEFAULT), H5Gclose);
  bool ok = group.ok();
  for (const CameraValue& value : camera_values()) {
    const std::string name = value.name;
    ok = ok && (name == "width_px" || name == "height_px"
                    ? write_i32(group, value.name, static_cast<std::int32_t>(value.value))
                    : write_f64(group, value.name, value.value));
  }
  return ok;
}

struct OpenColumn {
  Handle dataset;
  std::vector<hsize_t> sizes;
};

/// Opens a data set and checks its rank, its element's kind and all dimensions but the first. `any` dimensions of the
/// frame are not checked (number of points).
Result<OpenColumn> open_column(const std::filesystem::path& file, hid_t root, const ColumnShape& shape,
                               bool any_first_frame_size = false) {
  const std::string path = std::string("/") + shape.name;
  Handle dataset(H5Dopen2(root, shape.name, H5P_DEFAULT), H5Dclose);
  if (!dataset.ok()) return file_error(file, path + " can't be opened: " + reason());
  const Handle space(H5Dget_space(dataset), H5Sclose);
  const int rank = H5Sget_simple_extent_ndims(space);
  std::vector<hsize_t> sizes(static_cast<std::size_t>(std::max(rank, 0)));
  if (rank > 0) H5Sget_simple_extent_dims(space, sizes.data(), nullptr);
  std::vector<hsize_t> expected{0};
  expected.insert(expected.end(), shape.frame.begin(), shape.frame.end());
  if (any_first_frame_size && sizes.size() > 1) expected[1] = sizes[1];
  if (sizes.size() != expected.size() || !std::equal(sizes.begin() + 1, sizes.end(), expected.begin() + 1)) {
    return file_error(file,
                      path + " has shape " + dimensions(sizes, nullptr) + ", expected " + dimensions(expected, "N"));
  }
  const Handle type(H5Dget_type(dataset), H5Tclose);
  const bool real = shape.element == Element::kF32 || shape.element == Element::kF64;
  if (H5Tget_class(type) != (real ? H5T_FLOAT : H5T_INTEGER))
    return file_error(file, path + " holds something else, expected " + words(shape.element));
  return OpenColumn{std::move(dataset), std::move(sizes)};
}

/// Where the frames lie, or why they can't be used there.
ColumnPlace find_place(hid_t dataset, const ColumnShape& shape, const std::vector<hsize_t>& sizes, bool user_block) {
  ColumnPlace place;
  place.present = true;
  const Handle type(H5Dget_type(dataset), H5Tclose);
  const Handle properties(H5Dget_create_plist(dataset), H5Pclose);
  if (H5Tequal(type, native_type(shape.element)) <= 0) {
    place.why_not_mapped = "stored as another type of number";
  } else if (H5Pget_external_count(properties) > 0) {
    place.why_not_mapped = "stored in another file";
  } else if (user_block) {
    place.why_not_mapped = "behind a user block";
  } else if (H5Pget_nfilters(properties) > 0) {
    place.why_not_mapped = "compressed";
  } else if (H5Pget_layout(properties) == H5D_CONTIGUOUS) {
    const haddr_t address = H5Dget_offset(dataset);
    place.frames_per_chunk = std::max<std::uint64_t>(1, sizes[0]);
    if (address == HADDR_UNDEF) {
      place.why_not_mapped = sizes[0] > 0 ? "not written yet" : "";
    } else {
      place.addresses = {address};
    }
  } else if (H5Pget_layout(properties) == H5D_CHUNKED) {
    std::vector<hsize_t> chunk(sizes.size());
    H5Pget_chunk(properties, static_cast<int>(chunk.size()), chunk.data());
    place.frames_per_chunk = chunk[0];
    if (!std::equal(chunk.begin() + 1, chunk.end(), sizes.begin() + 1)) {
      place.why_not_mapped = "chunked across images";
      return place;
    }
    const std::uint64_t chunks = (sizes[0] + chunk[0] - 1) / chunk[0];
    place.addresses.assign(chunks, 0);
    const Handle space(H5Dget_space(dataset), H5Sclose);
    hsize_t stored = 0;
    H5Dget_num_chunks(dataset, space, &stored);
    std::uint64_t found = 0;
    std::vector<hsize_t> offset(sizes.size());
    for (hsize_t i = 0; i < stored; ++i) {
      unsigned filters = 0;
      haddr_t address = HADDR_UNDEF;
      hsize_t bytes = 0;
      if (H5Dget_chunk_info(dataset, space, i, offset.data(), &filters, &address, &bytes) < 0) break;
      const std::uint64_t at = offset[0] / chunk[0];
      if (address == HADDR_UNDEF || at >= chunks) continue;
      place.addresses[at] = address;
      ++found;
    }
    if (found != chunks) place.why_not_mapped = "not written in all places";
  } else {
    place.why_not_mapped = "stored inside of its header";
  }
  const auto bytes = element_bytes(shape.element);
  if (std::ranges::any_of(place.addresses, [&](std::uint64_t address) { return address % bytes != 0; }))
    place.why_not_mapped = "not aligned";
  return place;
}

/// Format, version, what names the set, and the camera.
Result<DatasetInfo> read_info(const std::filesystem::path& path, hid_t file) {
  DatasetInfo info;
  const auto format = read_text(path, file, "format");
  if (!format) return format.failure();
  if (*format != kFormat) return file_error(path, "attribute format is '" + *format + "', expected '" + kFormat + "'");
  const auto version = read_whole(path, file, "version");
  if (!version) return version.failure();
  if (*version != kVersion) {
    return file_error(path, "has version " + std::to_string(*version) + ", expected " + std::to_string(kVersion) +
                                "; delete it to have it made again");
  }
  const auto kind = read_text(path, file, "kind");
  if (!kind) return kind.failure();
  constexpr std::array kKinds{DatasetKind::kSimulation, DatasetKind::kStereo, DatasetKind::kRecording};
  const auto* const known = std::ranges::find_if(kKinds, [&](DatasetKind each) { return *kind == name(each); });
  if (known == kKinds.end())
    return file_error(path, "attribute kind is '" + *kind + "', expected 'simulation', 'stereo' or 'recording'");
  info.kind = *known;
  const auto seed = read_whole(path, file, "seed");
  if (!seed) return seed.failure();
  const auto first_index = read_whole(path, file, "first_index");
  if (!first_index) return first_index.failure();
  info.seed = *seed;
  info.first_index = *first_index;
  if (H5Aexists(file, "note") > 0) {
    auto note = read_text(path, file, "note");
    if (!note) return note.failure();
    info.note = std::move(note).value();
  }
  if (H5Aexists(file, "round_part") > 0) {
    const auto part = read_number(path, file, "", "round_part");
    if (!part) return part.failure();
    if (!(*part >= 0.0 && *part <= 1.0))
      return file_error(path, "attribute round_part is " + std::to_string(*part) + ", expected 0 to 1");
    info.round_part = *part;
  }
  if (const Status camera = check_camera(path, file); !camera) return camera.failure();
  return info;
}

/// How many samples are whole, and where that is written; all frames when the file doesn't say.
Status read_written(const std::filesystem::path& path, hid_t file, bool user_block, DatasetLayout* layout) {
  layout->written = layout->frames;
  if (H5Lexists(file, "written", H5P_DEFAULT) <= 0) return {};
  const Handle dataset(H5Dopen2(file, "written", H5P_DEFAULT), H5Dclose);
  const Handle space(dataset.ok() ? H5Dget_space(dataset) : -1, H5Sclose);
  if (!space.ok() || H5Sget_simple_extent_npoints(space) != 1 ||
      H5Dread(dataset, H5T_NATIVE_UINT64, H5S_ALL, H5S_ALL, H5P_DEFAULT, &layout->written) < 0)
    return file_error(path, "/written can't be read as one whole number");
  if (layout->written > layout->frames) {
    return file_error(path, "/written is " + std::to_string(layout->written) + ", expected at most the " +
                                std::to_string(layout->frames) + " frames of the data sets");
  }
  const Handle type(H5Dget_type(dataset), H5Tclose);
  const haddr_t address = H5Dget_offset(dataset);
  if (H5Tequal(type, H5T_NATIVE_UINT64) > 0 && !user_block && address != HADDR_UNDEF) layout->written_address = address;
  return {};
}

}  // namespace

Status create_file(const std::filesystem::path& path, const DatasetInfo& info, const DatasetColumns& columns) {
  const Library library;
  const Handle creation(H5Pcreate(H5P_FILE_CREATE), H5Pclose);
  H5Pset_obj_track_times(creation, false);
  const Handle access = access_properties();
  Handle file(H5Fcreate(path.c_str(), H5F_ACC_TRUNC, creation, access), H5Fclose);
  if (!file.ok()) return file_error(path, "can't be made: " + reason());
  bool ok = write_text(file, "format", kFormat) && write_i32(file, "version", kVersion) &&
            write_text(file, "kind", name(info.kind)) && write_u64(file, "seed", info.seed) &&
            write_u64(file, "first_index", info.first_index) && write_text(file, "note", info.note) &&
            create_camera(file) && create_written(file);
  // Sets of square gates go without it, and so have the bytes that they always had.
  if (info.round_part > 0.0) ok = ok && write_f64(file, "round_part", info.round_part);
  const auto shapes = column_shapes(columns.points);
  const auto present = columns_of(info.kind, columns);
  for (std::size_t i = 0; i < kColumns; ++i) ok = ok && (!present[i] || create_column(file, shapes[i]));
  if (!ok) return file_error(path, "can't be made: " + reason());
  if (!file.close()) return file_error(path, "can't be written: " + reason());
  return {};
}

Result<DatasetLayout> read_layout(const std::filesystem::path& path) {
  const Library library;
  if (H5Fis_hdf5(path.c_str()) <= 0)
    return file_error(path, "is not an HDF5 file (sets made before version 2 have to be generated again)");
  const Handle file = open_file(path, H5F_ACC_RDONLY);
  if (!file.ok()) return file_error(path, "can't be read as HDF5: " + reason());

  DatasetLayout layout;
  auto info = read_info(path, file);
  if (!info) return info.failure();
  layout.info = std::move(info).value();
  const Handle creation(H5Fget_create_plist(file), H5Pclose);
  hsize_t user_block = 0;
  H5Pget_userblock(creation, &user_block);

  const auto exists = [&](const char* column) { return H5Lexists(file, column, H5P_DEFAULT) > 0; };
  if (exists("points_C")) {
    const auto points = open_column(path, file, column_shapes(1)[kPoints], true);
    if (!points) return points.failure();
    if (points->sizes[1] < 1 || points->sizes[1] > 1'000'000) {
      return file_error(
          path, "/points_C has " + std::to_string(points->sizes[1]) + " points an image, expected 1 to 1000000");
    }
    layout.columns.points = static_cast<int>(points->sizes[1]);
  }
  layout.columns.X_WC = exists("X_WC");
  layout.columns.sequence = exists("sequence");
  layout.columns.time = exists("time_s");
  const auto shapes = column_shapes(layout.columns.points);
  const auto required = columns_of(layout.info.kind, layout.columns);
  bool first = true;
  for (std::size_t i = 0; i < kColumns; ++i) {
    if (!exists(shapes[i].name)) {
      if (required[i] && i != kValidCount) {
        return file_error(path, std::string("/") + shapes[i].name + " is missing, expected in a set of kind '" +
                                    name(layout.info.kind) + "' with these data sets");
      }
      continue;
    }
    const auto column = open_column(path, file, shapes[i]);
    if (!column) return column.failure();
    if (first) layout.frames = column->sizes[0];
    if (column->sizes[0] != layout.frames) {
      return file_error(path, std::string("/") + shapes[i].name + " has " + std::to_string(column->sizes[0]) +
                                  " frames, expected " + std::to_string(layout.frames) + " as the others");
    }
    first = false;
    layout.places[i] = find_place(column->dataset, shapes[i], column->sizes, user_block > 0);
  }

  if (const Status written = read_written(path, file, user_block > 0, &layout); !written) return written.failure();
  return layout;
}

Status resize_file(const std::filesystem::path& path, const DatasetLayout& layout, std::uint64_t frames) {
  const Library library;
  Handle file = open_file(path, H5F_ACC_RDWR);
  if (!file.ok()) return file_error(path, "can't be opened to change its size: " + reason());
  const auto shapes = column_shapes(layout.columns.points);
  for (std::size_t i = 0; i < kColumns; ++i) {
    if (!layout.places[i].present) continue;
    Handle dataset(H5Dopen2(file, shapes[i].name, H5P_DEFAULT), H5Dclose);
    std::vector<hsize_t> sizes{frames};
    sizes.insert(sizes.end(), shapes[i].frame.begin(), shapes[i].frame.end());
    if (!dataset.ok() || H5Dset_extent(dataset, sizes.data()) < 0 || !dataset.close())
      return file_error(path, std::string("/") + shapes[i].name + " can't be resized: " + reason());
  }
  if (!file.close()) return file_error(path, "can't be resized: " + reason());
  return {};
}

Result<std::vector<std::byte>> load_column(const std::filesystem::path& path, Column column,
                                           const DatasetLayout& layout) {
  const Library library;
  const ColumnShape shape = column_shapes(layout.columns.points)[column];
  const Handle file = open_file(path, H5F_ACC_RDONLY);
  const Handle dataset(file.ok() ? H5Dopen2(file, shape.name, H5P_DEFAULT) : -1, H5Dclose);
  std::vector<std::byte> values(layout.frames * shape.frame_bytes());
  if (!dataset.ok() || H5Dread(dataset, native_type(shape.element), H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) < 0)
    return file_error(path, std::string("/") + shape.name + " can't be read: " + reason());
  return values;
}

}  // namespace gatefield::training
