// Reading and writing samples at the places that dataset_layout names.

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <utility>

#include "server/training/data/dataset.h"
#include "server/training/data/dataset_layout.h"

namespace gatefield::training {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kBlock = 256;            ///< frames that are written at once
constexpr std::uint64_t kSmallestGrowth = 1024;  ///< frames
constexpr std::uint64_t kMemoryLimit_bytes = std::uint64_t{4} << 30;
constexpr std::uint64_t kJournalMark = 0x3164726E6A746667;
static_assert(std::endian::native == std::endian::little, "files are little-endian and used in place");

Error system_error(const fs::path& file, const std::string& what) {
  return file_error(file, what + ": " + std::strerror(errno));
}

/// Closes what open() gave.
class Descriptor {
 public:
  explicit Descriptor(int number = -1) : number_(number) {}
  ~Descriptor() {
    if (number_ >= 0) ::close(number_);
  }
  Descriptor(Descriptor&& other) noexcept : number_(std::exchange(other.number_, -1)) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    std::swap(number_, other.number_);
    return *this;
  }
  int number() const { return number_; }
  bool ok() const { return number_ >= 0; }

 private:
  int number_;
};

bool write_at(int descriptor, std::uint64_t at, const void* data, std::size_t size) {
  const char* next = static_cast<const char*>(data);
  while (size > 0) {
    const ssize_t written = ::pwrite(descriptor, next, size, static_cast<off_t>(at));
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return false;
    next += written;
    at += static_cast<std::uint64_t>(written);
    size -= static_cast<std::size_t>(written);
  }
  return true;
}

bool read_at(int descriptor, std::uint64_t at, void* data, std::size_t size) {
  char* next = static_cast<char*>(data);
  while (size > 0) {
    const ssize_t got = ::pread(descriptor, next, size, static_cast<off_t>(at));
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return false;
    next += got;
    at += static_cast<std::uint64_t>(got);
    size -= static_cast<std::size_t>(got);
  }
  return true;
}

Result<std::uint64_t> size_of(const fs::path& file, int descriptor) {
  struct stat status {};
  if (::fstat(descriptor, &status) != 0) return system_error(file, "can't be examined");
  return static_cast<std::uint64_t>(status.st_size);
}

// --- Labels -------------------------------------------------------------------------------------------------------

void store_gate(const GateLabel& gate, float* out) {
  out[0] = gate.p_CG.x();
  out[1] = gate.p_CG.y();
  out[2] = gate.p_CG.z();
  out[3] = gate.q_CG.w();
  out[4] = gate.q_CG.x();
  out[5] = gate.q_CG.y();
  out[6] = gate.q_CG.z();
  out[7] = gate.visible_fraction;
  out[8] = static_cast<float>(gate.shape.inner_half_m);
  out[9] = static_cast<float>(gate.shape.outer_half_m);
  out[10] = static_cast<float>(gate.shape.thickness_m);
  out[11] = gate.shape.opening == GateShape::Opening::kRound ? 1.0f : 0.0f;
}

GateLabel load_gate(const float* in) {
  GateLabel gate;
  gate.p_CG = Eigen::Vector3f(in[0], in[1], in[2]);
  gate.q_CG = Eigen::Quaternionf(in[3], in[4], in[5], in[6]);
  gate.visible_fraction = in[7];
  gate.shape.inner_half_m = static_cast<double>(in[8]);
  gate.shape.outer_half_m = static_cast<double>(in[9]);
  gate.shape.thickness_m = static_cast<double>(in[10]);
  gate.shape.opening = in[11] == 1.0f ? GateShape::Opening::kRound : GateShape::Opening::kSquare;
  return gate;
}

/// Says which of a gate's values can't be; empty when all can.
std::string wrong_in_gate(const float* gate) {
  const auto wrong = [](const char* name, float value, const char* expected) {
    return std::string(name) + " is " + std::to_string(value) + ", expected " + expected;
  };
  for (int i = 0; i < 3; ++i) {
    if (!(std::abs(gate[i]) < 1e4f)) return wrong("p_CG", gate[i], "finite metres");
  }
  const float norm = std::sqrt(gate[3] * gate[3] + gate[4] * gate[4] + gate[5] * gate[5] + gate[6] * gate[6]);
  if (!(std::abs(norm - 1.0f) < 0.01f)) return wrong("the norm of q_CG", norm, "1");
  if (!((gate[7] >= 0.0f && gate[7] <= 1.0f) || gate[7] == -1.0f))
    return wrong("visible_fraction", gate[7], "0 to 1, or -1 to have it worked out");
  if (!(gate[8] > 0.0f && gate[8] < 100.0f)) return wrong("inner_half_m", gate[8], "more than 0 m");
  if (!(gate[9] > gate[8] && gate[9] < 100.0f)) return wrong("outer_half_m", gate[9], "more than inner_half_m");
  if (!(gate[10] > 0.0f && gate[10] < 100.0f)) return wrong("thickness_m", gate[10], "more than 0 m");
  if (gate[11] != 0.0f && gate[11] != 1.0f) return wrong("opening", gate[11], "0 (square) or 1 (round)");
  return {};
}

std::string wrong_in_pose(const float* pose) {
  for (int i = 0; i < 3; ++i) {
    if (!(std::abs(pose[i]) < 1e6f)) return "p_WC is " + std::to_string(pose[i]) + ", expected finite metres";
  }
  const float norm = std::sqrt(pose[3] * pose[3] + pose[4] * pose[4] + pose[5] * pose[5] + pose[6] * pose[6]);
  if (!(std::abs(norm - 1.0f) < 0.01f)) return "the norm of q_WC is " + std::to_string(norm) + ", expected 1";
  return {};
}

// --- The copy of a file's structure while it is enlarged ------------------------------------------------------------

fs::path journal_of(const fs::path& file) { return file.string() + ".journal"; }

struct Range {
  std::uint64_t begin;
  std::uint64_t end;
};

/// All bytes that are not in a chunk.
std::vector<Range> structure_of(const DatasetLayout& layout, std::uint64_t size) {
  std::vector<Range> chunks;
  const auto shapes = column_shapes(layout.columns.points);
  for (std::size_t i = 0; i < kColumns; ++i) {
    const ColumnPlace& place = layout.places[i];
    const std::uint64_t bytes = place.frames_per_chunk * shapes[i].frame_bytes();
    for (const std::uint64_t address : place.addresses) chunks.push_back({address, address + bytes});
  }
  std::ranges::sort(chunks, {}, &Range::begin);
  std::vector<Range> structure;
  std::uint64_t at = 0;
  for (const Range& chunk : chunks) {
    if (chunk.begin > at) structure.push_back({at, chunk.begin});
    at = std::max(at, chunk.end);
  }
  if (at < size) structure.push_back({at, size});
  return structure;
}

Status write_journal(const fs::path& file, int descriptor, const DatasetLayout& layout) {
  const auto size = size_of(file, descriptor);
  if (!size) return Error{size.error()};
  const std::vector<Range> ranges = structure_of(layout, *size);
  std::vector<std::uint64_t> head{kJournalMark, *size, ranges.size()};
  std::vector<char> bytes;
  for (const Range& range : ranges) {
    head.push_back(range.begin);
    head.push_back(range.end - range.begin);
    const std::size_t before = bytes.size();
    bytes.resize(before + (range.end - range.begin));
    if (!read_at(descriptor, range.begin, bytes.data() + before, range.end - range.begin))
      return system_error(file, "can't be read");
  }
  const fs::path unfinished = journal_of(file).string() + ".new";
  const Descriptor journal(::open(unfinished.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644));
  if (!journal.ok() || !write_at(journal.number(), 0, head.data(), head.size() * sizeof(head[0])) ||
      !write_at(journal.number(), head.size() * sizeof(head[0]), bytes.data(), bytes.size()) ||
      ::fsync(journal.number()) != 0 || ::rename(unfinished.c_str(), journal_of(file).c_str()) != 0)
    return system_error(journal_of(file), "can't be written");
  return {};
}

/// Puts back what an enlargement that was cut short may have left half changed.
Status apply_journal(const fs::path& file, int descriptor) {
  const fs::path path = journal_of(file);
  const Descriptor journal(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  if (!journal.ok()) return errno == ENOENT ? Status{} : Status{system_error(path, "can't be opened")};
  std::array<std::uint64_t, 3> head{};
  const auto length = size_of(path, journal.number());
  if (!length) return Error{length.error()};
  if (!read_at(journal.number(), 0, head.data(), sizeof(head)) || head[0] != kJournalMark || head[2] > *length / 16)
    return file_error(path, "is no journal of a data set; delete both files");
  std::vector<std::uint64_t> ranges(2 * head[2]);
  if (!read_at(journal.number(), sizeof(head), ranges.data(), ranges.size() * sizeof(ranges[0])))
    return file_error(path, "is cut short; delete both files");
  std::uint64_t at = sizeof(head) + ranges.size() * sizeof(ranges[0]);
  for (std::size_t i = 0; i < ranges.size(); i += 2) {
    if (ranges[i + 1] > *length) return file_error(path, "is cut short; delete both files");
    std::vector<char> bytes(ranges[i + 1]);
    if (!read_at(journal.number(), at, bytes.data(), bytes.size()))
      return file_error(path, "is cut short; delete both files");
    if (!write_at(descriptor, ranges[i], bytes.data(), bytes.size())) return system_error(file, "can't be repaired");
    at += bytes.size();
  }
  if (::ftruncate(descriptor, static_cast<off_t>(head[1])) != 0 || ::unlink(path.c_str()) != 0)
    return system_error(file, "can't be repaired");
  return {};
}

}  // namespace

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

// --- Writing ------------------------------------------------------------------------------------------------------

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
    if (!now) return Error{now.error()};
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
    if (const Status made = create_file(unfinished, info, columns); !made) return Error{made.error()};
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
  if (const Status repaired = apply_journal(file, state->descriptor.number()); !repaired)
    return Error{repaired.error()};
  auto layout = read_layout(file);
  if (!layout) return Error{layout.error()};
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

// --- Reading ------------------------------------------------------------------------------------------------------

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
  if (!layout) return Error{layout.error()};
  const auto size = size_of(file, descriptor.number());
  if (!size) return Error{size.error()};

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
    if (!values) return Error{values.error()};
    content->loaded[i] = std::move(values).value();
    frames.per_chunk = content->layout.frames;
    frames.chunks = {content->loaded[i].data()};
  }
  if (const Status labels = content->check_labels(file); !labels) return Error{labels.error()};
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
