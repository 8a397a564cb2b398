#pragma once

#include <chrono>
#include <thread>
#include <vector>

namespace gatefield::service {

/// Time on processors since the thread began: unlike the clock's, it does not count what else ran on them.
/// Real-time safe: a system call of some hundred nanoseconds.
std::chrono::nanoseconds processor_time_of_thread() noexcept;
/// Of those of these threads that were not joined yet, together.
std::chrono::nanoseconds processor_time_of(const std::vector<std::thread>& threads) noexcept;
/// Of all threads that the process has or had.
std::chrono::nanoseconds processor_time_of_process() noexcept;

/// How much this process may use at once, cores: those that it may run on, or less where its control group (version 2)
/// or one above it has a quota.
double usable_cores();

}  // namespace gatefield::service
