#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
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

constexpr std::uint64_t kBlock = 256;            ///< frames that are written at once
constexpr std::uint64_t kSmallestGrowth = 1024;  ///< frames

}  // namespace

struct DatasetWriter::State {
  fs::path file;
  Descriptor descriptor;
  DatasetLayout layout;
  std::array<ColumnShape, kColumns> shapes;
  std::array<std::vector<std::byte>, kColumns> block;  ///< frames that are not written yet
  std::uint64_t waiting = 0;
  bool closed = false;

  template <typename T>
  void put(Column column, const T* values, std::size_t count) {
    const auto* bytes = reinterpret_cast<const std::byte*>(values);
    block[column].insert(block[column].end(), bytes, bytes + count * sizeof(T));
  }

  Status resize(std::uint64_t frames) {
    if (frames == layout.frames) return {};
    if (Status kept = write_journal(file, descriptor.number(), layout); !kept) return kept;
    if (Status resized = resize_file(file, layout, frames); !resized) {
      const Status repaired = apply_journal(file, descriptor.number());
      return repaired ? resized : repaired;
    }
    auto now = read_layout(file);
    if (!now) return now.failure();
    layout = std::move(now).value();
    if (::unlink(journal_of(file).c_str()) != 0) return system_error(journal_of(file), "can't be removed");
    return {};
  }

  Status flush() {
    if (waiting == 0) return {};
    const std::uint64_t needed = layout.written + waiting;
    if (needed > layout.frames) {
      const std::uint64_t room = std::max({needed, layout.frames + layout.frames / 2, kSmallestGrowth});
      if (Status grown = resize(room); !grown) return grown;
    }
    for (std::size_t i = 0; i < kColumns; ++i) {
      const ColumnPlace& place = layout.places[i];
      if (!place.present) continue;
      const std::size_t frame_bytes = shapes[i].frame_bytes();
      for (std::uint64_t done = 0; done < waiting;) {
        const std::uint64_t frame = layout.written + done;
        const std::uint64_t within = frame % place.frames_per_chunk;
        const std::uint64_t count = std::min(waiting - done, place.frames_per_chunk - within);
        const std::uint64_t address = place.addresses[frame / place.frames_per_chunk] + within * frame_bytes;
        if (!write_at(descriptor.number(), address, block[i].data() + done * frame_bytes, count * frame_bytes))
          return system_error(file, "can't be written");
        done += count;
      }
    }
    // Last: until here, a reader or a later writer takes the new frames for not there.
    if (!write_at(descriptor.number(), layout.written_address, &needed, sizeof(needed)))
      return system_error(file, "can't be written");
    layout.written = needed;
    waiting = 0;
    for (auto& bytes : block) bytes.clear();
    return {};
  }
};

DatasetWriter::DatasetWriter(std::unique_ptr<State> state) noexcept : state_(std::move(state)) {}
DatasetWriter::DatasetWriter(DatasetWriter&&) noexcept = default;
DatasetWriter& DatasetWriter::operator=(DatasetWriter&&) noexcept = default;
DatasetWriter::~DatasetWriter() {
  if (state_ && !state_->closed) static_cast<void>(state_->flush());
}

Result<DatasetWriter> DatasetWriter::open(const fs::path& file, const DatasetInfo& info,
                                          const DatasetColumns& columns) {
  if (columns.points < 0 || columns.points > 1'000'000)
    return file_error(file, "points is " + std::to_string(columns.points) + ", expected 0 to 1000000");
  std::error_code folder_error;
  if (file.has_parent_path()) fs::create_directories(file.parent_path(), folder_error);
  if (folder_error) return file_error(file, "the folder can't be made: " + folder_error.message());
  struct stat status {};
  if (::stat(file.c_str(), &status) != 0) {
    if (errno != ENOENT) return system_error(file, "can't be examined");
    // Under another name until it is whole.
    const fs::path unfinished = file.string() + ".new";
    const Descriptor probe(::open(unfinished.c_str(), O_RDWR | O_CREAT | O_TRUNC | O_CLOEXEC, 0644));
    if (!probe.ok()) return system_error(file, "can't be opened for writing");
    if (const Status made = create_file(unfinished, info, columns); !made) return made.failure();
    if (::rename(unfinished.c_str(), file.c_str()) != 0) return system_error(file, "can't be made");
  }

  auto state = std::make_unique<State>();
  state->file = file;
  state->descriptor = Descriptor(::open(file.c_str(), O_RDWR | O_CLOEXEC));
  if (!state->descriptor.ok()) return system_error(file, "can't be opened for writing");
  struct flock lock {};
  lock.l_type = F_WRLCK;
  lock.l_whence = SEEK_SET;
  if (::fcntl(state->descriptor.number(), F_OFD_SETLK, &lock) != 0) {
    if (errno == EAGAIN || errno == EACCES) return file_error(file, "is being written by another process");
    return system_error(file, "can't be locked");
  }
  if (const Status repaired = apply_journal(file, state->descriptor.number()); !repaired) return repaired.failure();
  auto layout = read_layout(file);
  if (!layout) return layout.failure();
  state->layout = std::move(layout).value();
  state->shapes = column_shapes(columns.points);
  const DatasetInfo& found = state->layout.info;
  if (found.kind != info.kind) {
    return file_error(file, std::string("is of kind '") + name(found.kind) + "', expected '" + name(info.kind) + "'");
  }
  if (found.seed != info.seed || found.first_index != info.first_index) {
    return file_error(file, "holds seed " + std::to_string(found.seed) + " from index " +
                                std::to_string(found.first_index) + ", expected seed " + std::to_string(info.seed) +
                                " from index " + std::to_string(info.first_index));
  }
  if (found.round_part != info.round_part) {
    return file_error(file, "has a part of " + std::to_string(found.round_part) + " round gates, expected " +
                                std::to_string(info.round_part));
  }
  if (state->layout.columns.points != columns.points) {
    return file_error(file, "has " + std::to_string(state->layout.columns.points) +
                                " stored points an image, expected " + std::to_string(columns.points));
  }
  const auto expected = columns_of(info.kind, columns);
  for (std::size_t i = 0; i < kColumns; ++i) {
    const ColumnPlace& place = state->layout.places[i];
    const std::string path = std::string("/") + state->shapes[i].name;
    if (place.present != expected[i])
      return file_error(file, path + (expected[i] ? " is missing" : " is there, but is not written this time"));
    if (place.present &&
        (!place.why_not_mapped.empty() || place.addresses.size() * place.frames_per_chunk < state->layout.frames))
      return file_error(file, path + " can't be appended to: " + place.why_not_mapped);
  }
  if (state->layout.written_address == 0)
    return file_error(file, "can't be appended to: it was not made by gatefield-train (there is no /written)");
  return DatasetWriter(std::move(state));
}

Status DatasetWriter::reserve(std::uint64_t count) {
  if (count <= state_->layout.frames) return {};
  return state_->resize(count);
}

std::uint64_t DatasetWriter::count() const noexcept { return state_->layout.written + state_->waiting; }

const DatasetInfo& DatasetWriter::info() const noexcept { return state_->layout.info; }

Status DatasetWriter::append(const Sample& sample) {
  State& state = *state_;
  const auto refuse = [&](const std::string& what) {
    return file_error(state.file, "sample " + std::to_string(count()) + ": " + what);
  };
  if (state.closed) return refuse("the writer is closed");
  const auto& places = state.layout.places;
  const auto size_is = [&](Column column, const char* member, std::size_t size, std::size_t expected) -> std::string {
    const std::size_t wanted = places[column].present ? expected : 0;
    if (size == wanted || !places[column].present) return {};
    return std::string(member) + " has " + std::to_string(size) + " values, expected " + std::to_string(wanted);
  };
  const auto points = static_cast<std::size_t>(state.layout.columns.points);
  for (const std::string& wrong : {size_is(kCleanMm, "clean_mm", sample.clean_mm.size(), kImageSize_px),
                                   size_is(kSurface, "surface", sample.surface.size(), kImageSize_px),
                                   size_is(kMeasuredMm, "measured_mm", sample.measured_mm.size(), kImageSize_px),
                                   size_is(kPoints, "points_C", sample.points_C.size(), 3 * points),
                                   size_is(kSdf, "sdf_m", sample.sdf_m.size(), points)}) {
    if (!wrong.empty()) return refuse(wrong);
  }
  if (places[kPose].present && !sample.X_WC) return refuse("X_WC is missing");
  if (places[kSequence].present && !sample.sequence) return refuse("sequence is missing");
  if (places[kTime].present && !(sample.time_s && std::isfinite(*sample.time_s)))
    return refuse("time_s is missing or not finite");
  if (sample.gate_count < 0 || sample.gate_count > kMaxGates)
    return refuse("gate_count is " + std::to_string(sample.gate_count) + ", expected 0 to " +
                  std::to_string(kMaxGates));
  std::array<float, kMaxGates * kGateValues> gates{};
  int valid = 0;
  for (std::size_t g = 0; g < static_cast<std::size_t>(sample.gate_count); ++g) {
    store_gate(sample.gates[g], &gates[g * kGateValues]);
    const std::string wrong = wrong_in_gate(&gates[g * kGateValues]);
    if (!wrong.empty()) return refuse("gate " + std::to_string(g) + ": " + wrong);
    valid += sample.gates[g].valid() ? 1 : 0;
  }
  if (sample.valid_count != valid)
    return refuse("valid_count is " + std::to_string(sample.valid_count) + ", expected " + std::to_string(valid));
  std::array<float, 7> pose{};
  if (places[kPose].present) {
    const Eigen::Vector3f p_WC = sample.X_WC->translation();
    const Eigen::Quaternionf q_WC(sample.X_WC->linear());
    pose = {p_WC.x(), p_WC.y(), p_WC.z(), q_WC.w(), q_WC.x(), q_WC.y(), q_WC.z()};
    const std::string wrong = wrong_in_pose(pose.data());
    if (!wrong.empty()) return refuse("X_WC: " + wrong);
  }

  if (places[kCleanMm].present) state.put(kCleanMm, sample.clean_mm.data(), kImageSize_px);
  if (places[kSurface].present) state.put(kSurface, sample.surface.data(), kImageSize_px);
  if (places[kMeasuredMm].present) state.put(kMeasuredMm, sample.measured_mm.data(), kImageSize_px);
  state.put(kGates, gates.data(), gates.size());
  const std::int32_t counts[2] = {sample.gate_count, sample.valid_count};
  state.put(kGateCount, &counts[0], 1);
  state.put(kValidCount, &counts[1], 1);
  if (places[kPose].present) state.put(kPose, pose.data(), pose.size());
  if (places[kSequence].present) state.put(kSequence, &*sample.sequence, 1);
  if (places[kTime].present) state.put(kTime, &*sample.time_s, 1);
  if (points > 0) {
    state.put(kPoints, sample.points_C.data(), 3 * points);
    state.put(kSdf, sample.sdf_m.data(), points);
  }
  ++state.waiting;
  return state.waiting == kBlock ? state.flush() : Status{};
}

Status DatasetWriter::flush() { return state_->flush(); }

Status DatasetWriter::close() {
  if (state_->closed) return {};
  if (Status flushed = state_->flush(); !flushed) return flushed;
  state_->closed = true;
  if (Status trimmed = state_->resize(state_->layout.written); !trimmed) return trimmed;
  if (::fsync(state_->descriptor.number()) != 0) return system_error(state_->file, "can't be written");
  state_->descriptor = Descriptor();
  return {};
}

}  // namespace gatefield::training
