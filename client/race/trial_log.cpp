#include "client/race/trial_log.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <map>

#include "client/race/trial_table.h"
#include "common/base/whole_file.h"

namespace gatefield::race {
namespace {

namespace fs = std::filesystem;

/// Errors of the system, with what we were at.
Error system_error(const fs::path& file, const std::string& what) {
  return Error{what + " (" + std::strerror(errno) + ")", ErrorCode::kUnreadable}.at(file.string());
}

}  // namespace

std::vector<TrialResult> newest(const std::vector<TrialResult>& results) {
  std::vector<TrialResult> out;
  std::map<std::string, std::size_t> places;
  for (const TrialResult& result : results) {
    const auto [at, is_new] = places.emplace(trial_name(result), out.size());
    if (is_new) {
      out.push_back(result);
    } else if (result.failure != Failure::kLostServer || out[at->second].failure == Failure::kLostServer) {
      out[at->second] = result;
    }
  }
  return out;
}

Result<std::vector<TrialResult>> read_trial_file(const fs::path& file) {
  const auto text = read_file(file);
  if (!text) return text.failure();
  std::vector<TrialResult> results;
  int number = 0;
  for (std::size_t begin = 0;;) {
    const std::size_t end = text->find('\n', begin);
    if (end == std::string::npos) break;
    const std::string line = text->substr(begin, end - begin);
    begin = end + 1;
    ++number;
    if (number == 1) {
      if (line != csv_header())
        return Error{"is not the header of a table of trials, expected " + csv_header(), ErrorCode::kUnreadable}.at(
            file.string(), 1);
      continue;
    }
    auto result = parse_csv_line(line);
    if (!result) return result.failure().at(file.string(), number);
    results.push_back(std::move(result).value());
  }
  return results;
}

Result<std::vector<TrialResult>> read_trials(const fs::path& folder) {
  std::vector<fs::path> files;
  std::error_code failure;
  for (const auto& entry : fs::directory_iterator(folder, failure)) {
    const std::string name = entry.path().filename().string();
    if (name.starts_with("trials") && name.ends_with(".csv")) files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  std::vector<TrialResult> all;
  for (const fs::path& file : files) {
    const auto results = read_trial_file(file);
    if (!results) return results.failure();
    all.insert(all.end(), results->begin(), results->end());
  }
  return newest(all);
}

Result<std::unique_ptr<TrialLog>> TrialLog::open(const fs::path& file) {
  std::error_code failure;
  if (file.has_parent_path()) fs::create_directories(file.parent_path(), failure);
  const int descriptor = ::open(file.c_str(), O_RDWR | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
  if (descriptor < 0) return system_error(file, "can't be opened, expected a folder that this user may write to");
  std::unique_ptr<TrialLog> log(new TrialLog(file, descriptor));
  if (::flock(descriptor, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK)
    return Error{"is being written by another gatefield-race, expected one at a time (or --shard)",
                 ErrorCode::kUnreadable}
        .at(file.string());

  const auto text = read_file(file);
  if (!text) return text.failure();
  const std::size_t whole = text->rfind('\n') == std::string::npos ? 0 : text->rfind('\n') + 1;
  if (whole < text->size() && ::ftruncate(descriptor, static_cast<off_t>(whole)) != 0)
    return system_error(file, "its unfinished last line can't be cut off");
  if (whole == 0) {
    if (auto status = log->write(csv_header() + "\n"); !status) return status.failure();
  } else if (!text->starts_with(csv_header() + "\n")) {
    return Error{"is not the header of this program's table of trials, expected a new folder, or " + csv_header(),
                 ErrorCode::kUnreadable}
        .at(file.string(), 1);
  }
  return log;
}

TrialLog::~TrialLog() { ::close(descriptor_); }

Status TrialLog::append(const TrialResult& result) { return write(csv_line(result) + "\n"); }

Status TrialLog::write(const std::string& line) {
  const std::lock_guard lock(mutex_);
  struct stat before {};
  if (::fstat(descriptor_, &before) != 0) return system_error(file_, "can't be looked at");
  std::size_t done = 0;
  while (done < line.size()) {
    const ssize_t written = ::write(descriptor_, line.data() + done, line.size() - done);
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) {
      const Error error = system_error(file_, "can't be written, expected room on the disk");
      // What was begun is taken back; if even that fails, the next start cuts it off.
      [[maybe_unused]] const int taken_back = ::ftruncate(descriptor_, before.st_size);
      return error;
    }
    done += static_cast<std::size_t>(written);
  }
  if (::fdatasync(descriptor_) != 0 && errno != EINVAL && errno != EROFS)
    return system_error(file_, "can't be put on the disk");
  return {};
}

std::string log_name(const Shard& shard) {
  if (shard.count == 1) return "trials.csv";
  return "trials-" + std::to_string(shard.index) + "-of-" + std::to_string(shard.count) + ".csv";
}

}  // namespace gatefield::race
