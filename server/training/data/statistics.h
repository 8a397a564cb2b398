#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "server/training/data/dataset.h"

namespace gatefield::training {

/// What is in a data set, as counts of frames; distances, angles and visibility are the target's (the nearest valid
/// gate).
struct DatasetStatistics {
  struct Part {
    std::string name;
    std::uint64_t frames = 0;
    std::uint64_t of = 0;  ///< of how many
    double part() const noexcept { return of > 0 ? static_cast<double>(frames) / static_cast<double>(of) : 0.0; }
  };
  struct Group {
    std::string title;
    std::vector<Part> parts;
  };
  std::uint64_t frames = 0;
  std::vector<Group> groups;

  /// @return the named part, or one with of = 0
  Part find(const std::string& group, const std::string& part) const;
};

/// Counts over at most `limit` frames spread evenly (0: all). Sets of kind kSimulation must have been made by
/// generate_dataset() of this version: what the labels don't say (clutter, frames of the wrong size) is drawn again
/// from seed and index.
DatasetStatistics count_statistics(const Dataset& dataset, std::uint64_t limit = 0);

/// A table for people.
std::string to_text(const DatasetStatistics& statistics);

}  // namespace gatefield::training
