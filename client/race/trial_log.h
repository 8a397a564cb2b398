#pragma once

#include <filesystem>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "client/race/trial_result.h"

namespace gatefield::race {

/// Every result in the folder's trials*.csv, one per trial: of several lines for a trial, the last one that is not
/// about a lost server counts, else the last one. A line that was not finished (no line end) is not there.
/// Order: as in the files, which are read by name. A folder without such a file gives none.
/// Errors: the sentence names file, line and column.
Result<std::vector<TrialResult>> read_trials(const std::filesystem::path& folder);

/// The same of one file. Errors: also a file that isn't there.
Result<std::vector<TrialResult>> read_trial_file(const std::filesystem::path& file);

/// One per trial, as read_trials() says.
std::vector<TrialResult> newest(const std::vector<TrialResult>& results);

/// A file of results that only grows, a line a trial, each written whole or not at all and on the disk when append()
/// returns. Thread-safe: append() yes.
class TrialLog {
 public:
  /// Opens or begins a file; an unfinished last line is cut off.
  /// Errors: not writable, in use by another program, or no such file of ours.
  static Result<std::unique_ptr<TrialLog>> open(const std::filesystem::path& file);
  ~TrialLog();
  TrialLog(const TrialLog&) = delete;
  TrialLog& operator=(const TrialLog&) = delete;

  Status append(const TrialResult& result);

 private:
  TrialLog(std::filesystem::path file, int descriptor) : file_(std::move(file)), descriptor_(descriptor) {}
  Status write(const std::string& line);

  std::filesystem::path file_;
  int descriptor_;
  std::mutex mutex_;
};

/// "trials.csv", or "trials-3-of-16.csv": shards may share a folder.
std::string log_name(const Shard& shard);

}  // namespace gatefield::race
