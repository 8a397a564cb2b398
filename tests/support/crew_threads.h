#pragma once

#include <atomic>
#include <thread>
#include <vector>

#include "server/kernels/crew.h"

namespace gatefield::test {

/// Threads that do nothing but help a crew, for tests and benchmarks: the server's own threads help between their
/// steps.
class CrewThreads {
 public:
  CrewThreads(kernels::Crew* crew, int count) {
    for (int i = 0; i < count; ++i) {
      threads_.emplace_back([this, crew] {
        while (!stopping_.load(std::memory_order_relaxed))
          if (!crew->help()) kernels::relax();
      });
    }
  }
  ~CrewThreads() {
    stopping_ = true;
    for (std::thread& thread : threads_) thread.join();
  }

 private:
  std::atomic<bool> stopping_{false};
  std::vector<std::thread> threads_;
};

}  // namespace gatefield::test
