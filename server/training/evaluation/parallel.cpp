#include "server/training/evaluation/parallel.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <thread>
#include <vector>

namespace gatefield::training {

bool for_each_index(std::uint64_t count, int threads, const std::function<void(int, std::uint64_t)>& work,
                    const std::function<bool(std::uint64_t)>& progress) {
  std::atomic<std::uint64_t> next{0};
  std::atomic<std::uint64_t> done{0};
  std::atomic<bool> stop{false};
  std::mutex mutex;
  std::condition_variable ended;
  int running = std::max(1, threads);
  {
    std::vector<std::jthread> helpers;
    for (int thread = 0; thread < std::max(1, threads); ++thread) {
      helpers.emplace_back([&, thread] {
        for (std::uint64_t i = next++; i < count && !stop; i = next++) {
          work(thread, i);
          ++done;
        }
        const std::lock_guard lock(mutex);
        --running;
        ended.notify_one();
      });
    }
    std::unique_lock lock(mutex);
    while (!ended.wait_for(lock, std::chrono::milliseconds(250), [&] { return running == 0; })) {
      if (progress && !progress(done)) stop = true;
    }
  }
  if (progress && !stop && !progress(done)) stop = true;
  return !stop;
}

}  // namespace gatefield::training
