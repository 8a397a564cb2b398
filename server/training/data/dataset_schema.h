#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "server/training/data/dataset.h"

/// What a data set's HDF5 file holds (docs/datasets.md), apart from where it lies there. Not for use outside of this
/// folder. Thread-safe: yes.
namespace gatefield::training {

/// The data sets of a file, first dimension: frame.
enum Column : std::size_t {
  kCleanMm,
  kSurface,
  kMeasuredMm,
  kGates,
  kGateCount,
  kValidCount,
  kPose,
  kSequence,
  kTime,
  kPoints,
  kSdf,
  kColumns
};
enum class Element { kU8, kU16, kI32, kU32, kF32, kF64 };
std::size_t element_bytes(Element element);

struct ColumnShape {
  const char* name;
  Element element;
  std::vector<std::uint64_t> frame;  ///< dimensions of one frame's part
  std::size_t frame_bytes() const;
};
/// Values of a gate: p_CG xyz, q_CG wxyz, visible fraction, inner, outer half-width, thickness, opening (1 = round).
inline constexpr std::size_t kGateValues = 12;

/// @param points query points an image; for the two last columns
std::array<ColumnShape, kColumns> column_shapes(int points);
/// Which columns a set of this kind must have.
std::array<bool, kColumns> columns_of(DatasetKind kind, const DatasetColumns& columns);

/// "data set <file>: <what>"
Error file_error(const std::filesystem::path& file, const std::string& what);

}  // namespace gatefield::training
