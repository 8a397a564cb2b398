#include "server/operations/spare_memory.h"

#include <malloc.h>

namespace gatefield::operations {
namespace {

using namespace std::chrono_literals;

constexpr auto kQuiet = 2s;  // the last vehicle's program takes its leave of the network, too

constexpr int kKept_bytes = 64 << 20, kLargestFrame_bytes = 8 << 20;

}  // namespace

SpareMemory::SpareMemory() {
  mallopt(M_TRIM_THRESHOLD, kKept_bytes);
  mallopt(M_MMAP_THRESHOLD, kLargestFrame_bytes);
}

bool SpareMemory::look(const service::Figures& figures) {
  if (!figures.vehicles.empty() || figures.stands_by_for != 0) {
    quiet_since_.reset();
    return false;
  }
  if (!quiet_since_) quiet_since_ = figures.made;
  if (figures.sessions_begun == tidy_for_ || figures.made - *quiet_since_ < kQuiet) return false;
  tidy_for_ = figures.sessions_begun;
  malloc_trim(0);
  return true;
}

}  // namespace gatefield::operations
