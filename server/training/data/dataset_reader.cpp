#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <bit>
#include <utility>
#include <vector>

#include "server/training/data/dataset.h"
#include "server/training/data/dataset_bytes.h"
#include "server/training/data/dataset_journal.h"
#include "server/training/data/dataset_labels.h"
#include "server/training/data/dataset_layout.h"

namespace gatefield::training {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kMemoryLimit_bytes = std::uint64_t{4} << 30;
static_assert(std::endian::native == std::endian::little, "files are little-endian and used in place");

}  // namespace

struct Dataset::Content {
  const std::byte* data = nullptr;  ///< the mapped file
  std::size_t bytes = 0;
  DatasetLayout layout;
  std::array<std::vector<std::byte>, kColumns> loaded;
  bool all_mapped = true;

  struct Frames {
    std::vector<const std::byte*> chunks;
    std::uint64_t per_chunk = 1;
    std::size_t frame_bytes = 0;
  };
  std::array<Frames, kColumns> frames;

  Content() = default;
  Content(const Content&) = delete;
  Content& operator=(const Content&) = delete;
  ~Content() {
    if (data != nullptr) ::munmap(const_cast<std::byte*>(data), bytes);
  }

  bool has(Column column) const noexcept { return layout.places[column].present; }
  template <typename T>
  const T* get(Column column, std::uint64_t index) const noexcept {
    const Frames& at = frames[column];
    return reinterpret_cast<const T*>(at.chunks[index / at.per_chunk] + index % at.per_chunk * at.frame_bytes);
  }
  template <typename T>
  std::span<const T> image(Column column, std::uint64_t index, std::size_t size) const noexcept {
    return has(column) ? std::span<const T>(get<T>(column, index), size) : std::span<const T>();
  }

  Status check_labels(const fs::path& file) const {
    for (std::uint64_t i = 0; i < layout.written; ++i) {
      const auto refuse = [&](const char* dataset, const std::string& what) {
        return file_error(file, std::string("/") + dataset + "[" + std::to_string(i) + "]: " + what);
      };
      const std::int32_t count = *get<std::int32_t>(kGateCount, i);
      if (count < 0 || count > kMaxGates)
        return refuse("gate_count", "is " + std::to_string(count) + ", expected 0 to " + std::to_string(kMaxGates));
      const float* gates = get<float>(kGates, i);
      int valid = 0;
      bool known = true;
      for (std::int32_t g = 0; g < count; ++g) {
        const float* gate = gates + static_cast<std::size_t>(g) * kGateValues;
        const std::string wrong = wrong_in_gate(gate);
        if (!wrong.empty()) return refuse("gates", "gate " + std::to_string(g) + ": " + wrong);
        valid += gate[7] >= kValidVisibleFraction ? 1 : 0;
        known = known && gate[7] >= 0.0f;
      }
      if (known && has(kValidCount) && *get<std::int32_t>(kValidCount, i) != valid) {
        return refuse("valid_count", "is " + std::to_string(*get<std::int32_t>(kValidCount, i)) + ", expected " +
                                         std::to_string(valid) + ", the gates with a visible_fraction of at least " +
                                         std::to_string(kValidVisibleFraction));
      }
      if (has(kPose)) {
        const std::string wrong = wrong_in_pose(get<float>(kPose, i));
        if (!wrong.empty()) return refuse("X_WC", wrong);
      }
    }
    return {};
  }
};

Dataset::Dataset(std::unique_ptr<Content> content) noexcept : content_(std::move(content)) {}
Dataset::~Dataset() = default;
Dataset::Dataset(Dataset&&) noexcept = default;
Dataset& Dataset::operator=(Dataset&&) noexcept = default;

Result<Dataset> Dataset::open(const fs::path& file) {
  const Descriptor descriptor(::open(file.c_str(), O_RDONLY | O_CLOEXEC));
  if (!descriptor.ok()) return system_error(file, "can't be opened");
  if (::access(journal_of(file).c_str(), F_OK) == 0) {
    return file_error(file, "is being enlarged, or was when its writer was killed; in that case repeat the command " +
                                std::string("that writes it, which repairs it"));
  }
  auto layout = read_layout(file);
  if (!layout) return layout.failure();
  const auto size = size_of(file, descriptor.number());
  if (!size) return size.failure();

  auto content = std::make_unique<Content>();
  content->layout = std::move(layout).value();
  void* const data = ::mmap(nullptr, *size, PROT_READ, MAP_SHARED, descriptor.number(), 0);
  if (data == MAP_FAILED) return system_error(file, "can't be mapped");
  content->data = static_cast<const std::byte*>(data);
  content->bytes = *size;

  const auto shapes = column_shapes(content->layout.columns.points);
  std::uint64_t loaded_bytes = 0;
  for (std::size_t i = 0; i < kColumns; ++i) {
    const ColumnPlace& place = content->layout.places[i];
    if (!place.present || content->layout.frames == 0) continue;
    Content::Frames& frames = content->frames[i];
    frames.frame_bytes = shapes[i].frame_bytes();
    if (place.why_not_mapped.empty()) {
      frames.per_chunk = place.frames_per_chunk;
      for (const std::uint64_t address : place.addresses) {
        if (address + frames.per_chunk * frames.frame_bytes > *size) {
          return file_error(file, std::string("/") + shapes[i].name + " is cut short: the file has " +
                                      std::to_string(*size) + " bytes, expected " +
                                      std::to_string(address + frames.per_chunk * frames.frame_bytes) + " at least");
        }
        frames.chunks.push_back(content->data + address);
      }
      continue;
    }
    content->all_mapped = false;
    loaded_bytes += content->layout.frames * frames.frame_bytes;
    if (loaded_bytes > kMemoryLimit_bytes) {
      return file_error(file, std::string("/") + shapes[i].name + " is " + place.why_not_mapped +
                                  ", so it would have to be read into memory, but with it that makes " +
                                  std::to_string(loaded_bytes >> 20) + " MiB, expected at most " +
                                  std::to_string(kMemoryLimit_bytes >> 20) +
                                  "; store it uncompressed in chunks of whole images (h5repack -f NONE -l " +
                                  shapes[i].name + ":CHUNK=128x...)");
    }
    auto values = load_column(file, static_cast<Column>(i), content->layout);
    if (!values) return values.failure();
    content->loaded[i] = std::move(values).value();
    frames.per_chunk = content->layout.frames;
    frames.chunks = {content->loaded[i].data()};
  }
  if (const Status labels = content->check_labels(file); !labels) return labels.failure();
  return Dataset(std::move(content));
}

std::uint64_t Dataset::size() const noexcept { return content_->layout.written; }
const DatasetInfo& Dataset::info() const noexcept { return content_->layout.info; }
const DatasetColumns& Dataset::columns() const noexcept { return content_->layout.columns; }
bool Dataset::mapped() const noexcept { return content_->all_mapped; }

SampleView Dataset::at(std::uint64_t index) const noexcept {
  const Content& content = *content_;
  SampleView view;
  view.clean_mm = content.image<std::uint16_t>(kCleanMm, index, kImageSize_px);
  view.surface = content.image<std::uint8_t>(kSurface, index, kImageSize_px);
  view.measured_mm = content.image<std::uint16_t>(kMeasuredMm, index, kImageSize_px);
  const auto points = static_cast<std::size_t>(content.layout.columns.points);
  view.points_C = content.image<float>(kPoints, index, 3 * points);
  view.sdf_m = content.image<float>(kSdf, index, points);
  view.gate_count = std::clamp(*content.get<std::int32_t>(kGateCount, index), 0, kMaxGates);
  const float* gates = content.get<float>(kGates, index);
  for (std::size_t i = 0; i < static_cast<std::size_t>(view.gate_count); ++i) {
    view.gates[i] = load_gate(gates + i * kGateValues);
    if (view.gates[i].visible_fraction < 0.0f) {
      view.gates[i].visible_fraction =
          visible_fraction(dataset_camera(), view.reference_mm(), view.gates[i].shape, view.gates[i].X_CG());
    }
  }
  sort_gates(&view);
  if (content.has(kPose)) {
    const float* pose = content.get<float>(kPose, index);
    Eigen::Isometry3f X_WC = Eigen::Isometry3f::Identity();
    X_WC.translation() = Eigen::Vector3f(pose[0], pose[1], pose[2]);
    X_WC.linear() = Eigen::Quaternionf(pose[3], pose[4], pose[5], pose[6]).normalized().toRotationMatrix();
    view.X_WC = X_WC;
  }
  if (content.has(kSequence)) view.sequence = *content.get<std::uint32_t>(kSequence, index);
  if (content.has(kTime)) view.time_s = *content.get<double>(kTime, index);
  return view;
}

}  // namespace gatefield::training
