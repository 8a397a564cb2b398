#include "server/training/data/dataset_schema.h"

#include <algorithm>

namespace gatefield::training {

const char* name(DatasetKind kind) noexcept {
  switch (kind) {
    case DatasetKind::kSimulation:
      return "simulation";
    case DatasetKind::kStereo:
      return "stereo";
    case DatasetKind::kRecording:
      return "recording";
  }
  return "";
}

std::size_t element_bytes(Element element) {
  switch (element) {
    case Element::kU8:
      return 1;
    case Element::kU16:
      return 2;
    case Element::kI32:
    case Element::kU32:
    case Element::kF32:
      return 4;
    case Element::kF64:
      return 8;
  }
  return 0;
}

std::size_t ColumnShape::frame_bytes() const {
  std::size_t bytes = element_bytes(element);
  for (const std::uint64_t size : frame) bytes *= size;
  return bytes;
}

std::array<ColumnShape, kColumns> column_shapes(int points) {
  constexpr std::uint64_t kHeight = kImageHeight_px;
  constexpr std::uint64_t kWidth = kImageWidth_px;
  const auto count = static_cast<std::uint64_t>(std::max(points, 1));
  return {{{"clean_mm", Element::kU16, {kHeight, kWidth}},
           {"surface", Element::kU8, {kHeight, kWidth}},
           {"depth_mm", Element::kU16, {kHeight, kWidth}},
           {"gates", Element::kF32, {kMaxGates, kGateValues}},
           {"gate_count", Element::kI32, {}},
           {"valid_count", Element::kI32, {}},
           {"X_WC", Element::kF32, {7}},
           {"sequence", Element::kU32, {}},
           {"time_s", Element::kF64, {}},
           {"points_C", Element::kF32, {count, 3}},
           {"sdf_m", Element::kF32, {count}}}};
}

std::array<bool, kColumns> columns_of(DatasetKind kind, const DatasetColumns& columns) {
  std::array<bool, kColumns> present{};
  present[kCleanMm] = kind != DatasetKind::kRecording;
  present[kSurface] = kind == DatasetKind::kSimulation;
  present[kMeasuredMm] = kind != DatasetKind::kSimulation;
  present[kGates] = present[kGateCount] = present[kValidCount] = true;
  present[kPose] = columns.X_WC;
  present[kSequence] = columns.sequence;
  present[kTime] = columns.time;
  present[kPoints] = present[kSdf] = columns.points > 0;
  return present;
}

Error file_error(const std::filesystem::path& file, const std::string& what) {
  return Error("data set " + file.string() + ": " + what, ErrorCode::kUnreadable);
}

}  // namespace gatefield::training
