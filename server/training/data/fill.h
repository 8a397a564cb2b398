#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <vector>

#include "server/training/data/dataset.h"

namespace gatefield::training {

/// A set that is made in blocks of jobs: the jobs of a block side by side, their samples written in the jobs' order.
struct FillPlan {
  DatasetInfo info;  ///< its note says what made the set: a file with another note isn't continued
  DatasetColumns columns;
  std::uint64_t count = 0;
  std::uint64_t jobs_per_block = 1;
  int threads = 1;
  /// Makes the samples of job 0 .. jobs_per_block - 1 of the block that begins after `done` samples: none of them when
  /// the set ends before. Called in several threads.
  std::function<void(std::uint64_t done, std::uint64_t job, std::vector<Sample>* samples)> make;
};

/// Makes the set, or what is missing of it; a file that was begun is continued to the same bytes.
/// @param progress  after each block; false stops, what is done stays
/// Errors: the file can't be opened or written, or something else made it.
Status fill_dataset(const std::filesystem::path& file, const FillPlan& plan,
                    const std::function<bool(const Progress&)>& progress);

}  // namespace gatefield::training
