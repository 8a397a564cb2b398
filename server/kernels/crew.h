#pragma once

#include <atomic>
#include <cstdint>
#include <memory>

namespace gatefield::kernels {

/// Work on many blocks, shared among threads that happen to be free. A crew owns no threads: whoever has a loop over
/// blocks calls run(); threads with nothing better to do call help(), which takes blocks of any run() in progress. Who
/// takes which block is a matter of chance, so a body writes nothing but its own block's results; sums over blocks are
/// made afterwards, in their order. Then results don't depend on the number of threads.
///
/// No lock, no allocation and no system call, except that a caller whose helper was put aside by the scheduler in the
/// middle of a block gives the processor away while it waits for that block.
/// Thread-safe: yes, but a body must not call run(). Real-time safe: yes.
class Crew {
 public:
  /// @param callers  how many threads may be in run() at once and be helped; more than that work alone
  explicit Crew(int callers);

  /// body(i) for i in [0, count), each once; when it returns all are done. @pre count <= 65535
  template <typename Body>
  void run(int count, const Body& body) noexcept {
    share(
        count, [](const void* it, int index) { (*static_cast<const Body*>(it))(index); }, &body);
  }

  /// Does blocks of others until there are none left to begin. @return whether there were any
  bool help() noexcept;

 private:
  using Call = void (*)(const void* body, int index);

  /// One loop in progress. `tickets` holds, from the high bits down: the number of the loop (32), its blocks (16), the
  /// next one to begin (16). A helper takes a block by adding one to it; that can only succeed while the loop that it
  /// read of is still on, and the loop isn't over before this block is done. So `call` and `body`, which were written
  /// before the tickets, are that loop's.
  struct alignas(64) Slot {
    std::atomic<bool> taken{false};
    std::atomic<std::uint64_t> tickets{0};
    std::atomic<int> unfinished{0};
    Call call = nullptr;
    const void* body = nullptr;
  };

  void share(int count, Call call, const void* body) noexcept;
  static bool work(Slot* slot) noexcept;

  const int callers_;
  const std::unique_ptr<Slot[]> slots_;
};

/// body(i) for i in [0, count) on this thread and on free ones of the crew; without a crew on this one alone, in order.
template <typename Body>
void share(Crew* crew, int count, const Body& body) noexcept {
  if (crew != nullptr) return crew->run(count, body);
  for (int i = 0; i < count; ++i) body(i);
}

/// A moment's rest in a loop that waits for another thread.
inline void relax() noexcept {
#if defined(__x86_64__)
  __builtin_ia32_pause();
#elif defined(__aarch64__)
  asm volatile("yield");
#endif
}

}  // namespace gatefield::kernels
