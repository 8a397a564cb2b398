#include "client/sdk/asked_history.h"

namespace gatefield::sdk {

void AskedHistory::note(Stamp from, const protocol::Asked& asked) noexcept {
  // Plans say for themselves what changes within them.
  const bool same = noted_ && asked.by == noted_by_ && !asked.told() && from >= noted_from_;
  noted_from_ = from;
  if (same) return;
  const std::uint32_t end = end_.load(std::memory_order_relaxed);
  noted_ = end - begin_.load(std::memory_order_acquire) < kCapacity;
  if (!noted_) return;
  noted_by_ = asked.by;
  ring_[end % kCapacity] = {from, asked};
  end_.store(end + 1, std::memory_order_release);
}

protocol::Asked AskedHistory::at(Stamp stamp) noexcept {
  const std::uint32_t begin = begin_.load(std::memory_order_relaxed);
  for (std::uint32_t end = end_.load(std::memory_order_acquire); end != begin; --end) {
    const Entry& entry = ring_[(end - 1) % kCapacity];
    if (entry.from > stamp) continue;
    begin_.store(end - 1, std::memory_order_release);  // the entry itself stays ours
    return entry.asked;
  }
  return {};
}

}  // namespace gatefield::sdk
