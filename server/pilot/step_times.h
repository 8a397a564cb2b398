#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>

#include "common/base/clock.h"

namespace gatefield::pilot {

/// How long steps took, counted by class: for people's graphs.
/// Thread-safe: yes.   Real-time safe: add() (atomic counting).
class StepTimes {
 public:
  /// Upper ends of the classes, s; a last one has all that took longer.
  static constexpr std::array kBounds_s{0.25e-3, 0.5e-3, 1e-3, 2e-3, 3e-3, 5e-3, 8e-3, 12e-3, 20e-3, 50e-3};
  static constexpr std::size_t kClasses = kBounds_s.size() + 1;

  struct Counts {
    std::array<std::uint64_t, kClasses> of_class{};
    double sum_s = 0.0;

    Counts& operator+=(const Counts& other) noexcept {
      for (std::size_t i = 0; i < kClasses; ++i) of_class[i] += other.of_class[i];
      sum_s += other.sum_s;
      return *this;
    }
    std::uint64_t all() const noexcept {
      std::uint64_t count = 0;
      for (const std::uint64_t part : of_class) count += part;
      return count;
    }
  };

  void add(Stamp took) noexcept {
    std::size_t i = 0;
    while (i < kBounds_s.size() && seconds(took) > kBounds_s[i]) ++i;
    of_class_[i].fetch_add(1, std::memory_order_relaxed);
    sum_ns_.fetch_add(took.count(), std::memory_order_relaxed);
  }
  Counts counts() const noexcept {
    Counts counts;
    for (std::size_t i = 0; i < kClasses; ++i) counts.of_class[i] = of_class_[i].load(std::memory_order_relaxed);
    counts.sum_s = 1e-9 * static_cast<double>(sum_ns_.load(std::memory_order_relaxed));
    return counts;
  }

 private:
  std::array<std::atomic<std::uint64_t>, kClasses> of_class_{};
  std::atomic<std::int64_t> sum_ns_{0};
};

}  // namespace gatefield::pilot
