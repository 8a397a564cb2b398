#pragma once

#include <array>
#include <atomic>
#include <cstdint>

namespace gatefield {

/// Newest-value mailbox for one writer and one reader (a triple buffer): the writer never waits, the reader never
/// waits, and only the newest value is seen; older ones are overwritten.
///
/// Why there is no race: the three slots are owned by exactly one of {writer, middle, reader} at any time. `middle_`
/// holds the index of the slot in between and one bit that says whether it is fresh. The writer fills its own slot and
/// swaps it with the middle (release: the contents are visible to whoever acquires the index); the reader swaps its own
/// slot with the middle (acquire) only when the bit says fresh. Each exchange is atomic, so no slot is ever owned
/// twice.
///
/// Thread-safe: one thread in write()/slot()/publish(), one thread in read().   Real-time safe: yes, when copying T is.
template <typename T>
class Mailbox {
 public:
  /// The writer's own slot, to be filled in place (keeps its capacity from earlier rounds), then published.
  T& slot() noexcept { return slots_[writer_]; }
  void publish() noexcept { writer_ = middle_.exchange(writer_ | kFresh, std::memory_order_acq_rel) & kIndex; }

  void write(const T& value) {
    slot() = value;
    publish();
  }

  /// The newest value since the last read, or nullptr when there is none. Valid until the next read().
  const T* read() noexcept {
    if ((middle_.load(std::memory_order_relaxed) & kFresh) == 0) return nullptr;
    reader_ = middle_.exchange(reader_, std::memory_order_acq_rel) & kIndex;
    return &slots_[reader_];
  }

  bool fresh() const noexcept { return (middle_.load(std::memory_order_relaxed) & kFresh) != 0; }

 private:
  static constexpr std::uint32_t kIndex = 3;
  static constexpr std::uint32_t kFresh = 4;

  std::array<T, 3> slots_{};
  alignas(64) std::atomic<std::uint32_t> middle_{1};
  alignas(64) std::uint32_t writer_ = 0;
  alignas(64) std::uint32_t reader_ = 2;
};

}  // namespace gatefield
