#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "server/training/data/dataset_schema.h"

/// Where things lie in a data set's HDF5 file. With hdf5_library.h and hdf5_attributes.h the only code that calls
/// libhdf5; samples themselves are read through a memory map and written with pwrite() at the places that are named
/// here. Not for use outside of this folder.
namespace gatefield::training {

/// Where a column's frames lie.
struct ColumnPlace {
  bool present = false;
  std::uint64_t frames_per_chunk = 1;
  std::vector<std::uint64_t> addresses;  ///< of the chunks, in bytes from the file's beginning
  std::string why_not_mapped;            ///< empty: the addresses can be used
};

struct DatasetLayout {
  DatasetInfo info;
  DatasetColumns columns;
  std::uint64_t frames = 0;           ///< room in the file
  std::uint64_t written = 0;          ///< whole samples
  std::uint64_t written_address = 0;  ///< of that number in the file; 0: the file has none (not made by us)
  std::array<ColumnPlace, kColumns> places;
};

/// Makes an empty file; an existing one is replaced.
Status create_file(const std::filesystem::path& path, const DatasetInfo& info, const DatasetColumns& columns);
/// Reads and checks all but the labels' values.
Result<DatasetLayout> read_layout(const std::filesystem::path& path);
/// Changes how many frames there is room for.
Status resize_file(const std::filesystem::path& path, const DatasetLayout& layout, std::uint64_t frames);
/// One whole column through the library, whatever its storage.
Result<std::vector<std::byte>> load_column(const std::filesystem::path& path, Column column,
                                           const DatasetLayout& layout);

}  // namespace gatefield::training
