#include "server/training/data/dataset_journal.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <vector>

#include "server/training/data/dataset_bytes.h"

namespace gatefield::training {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kJournalMark = 0x3164726E6A746667;

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

}  // namespace

fs::path journal_of(const fs::path& file) { return file.string() + ".journal"; }

Status write_journal(const fs::path& file, int descriptor, const DatasetLayout& layout) {
  const auto size = size_of(file, descriptor);
  if (!size) return size.failure();
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

Status apply_journal(const fs::path& file, int descriptor) {
  const fs::path path = journal_of(file);
  const Descriptor journal(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  if (!journal.ok()) return errno == ENOENT ? Status{} : Status{system_error(path, "can't be opened")};
  std::array<std::uint64_t, 3> head{};
  const auto length = size_of(path, journal.number());
  if (!length) return length.failure();
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

}  // namespace gatefield::training
