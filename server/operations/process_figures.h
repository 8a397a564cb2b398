#pragma once

#include <cstdint>

namespace gatefield::operations {

/// What this process takes, as the kernel says; 0 where it doesn't.
struct ProcessFigures {
  double cpu_s = 0.0;           ///< of all threads, since it began
  double start_unix_s = 0.0;    ///< when that was
  double resident_bytes = 0.0;  ///< memory
  double virtual_bytes = 0.0;
  std::uint64_t threads = 0;
  std::uint64_t open_files = 0;  ///< descriptors
  std::uint64_t most_files = 0;  ///< that it may have
};

/// Reads /proc/self. Thread-safe: yes.   Real-time safe: no.
ProcessFigures process_figures();

}  // namespace gatefield::operations
