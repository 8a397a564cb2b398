#include "server/service/processor_time.h"

#include <pthread.h>
#include <sched.h>
#include <time.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>

namespace gatefield::service {
namespace {

std::chrono::nanoseconds read(clockid_t clock) noexcept {
  timespec time{};
  if (clock_gettime(clock, &time) != 0) return std::chrono::nanoseconds{0};
  return std::chrono::seconds(time.tv_sec) + std::chrono::nanoseconds(time.tv_nsec);
}

/// What the group may use, cores; nothing when it may use all.
double quota_of(const std::filesystem::path& group) {
  std::ifstream file(group / "cpu.max");
  double quota_us = 0.0, period_us = 0.0;
  return file >> quota_us >> period_us && period_us > 0.0 ? quota_us / period_us : 0.0;  // "max" is no number
}

}  // namespace

std::chrono::nanoseconds processor_time_of_thread() noexcept { return read(CLOCK_THREAD_CPUTIME_ID); }

std::chrono::nanoseconds processor_time_of_process() noexcept { return read(CLOCK_PROCESS_CPUTIME_ID); }

std::chrono::nanoseconds processor_time_of(const std::vector<std::thread>& threads) noexcept {
  std::chrono::nanoseconds sum{0};
  for (const std::thread& thread : threads) {
    clockid_t clock{};
    if (!thread.joinable()) continue;
    if (pthread_getcpuclockid(const_cast<std::thread&>(thread).native_handle(), &clock) == 0) sum += read(clock);
  }
  return sum;
}

double usable_cores() {
  cpu_set_t set;
  CPU_ZERO(&set);
  double cores = std::max(1.0, static_cast<double>(std::thread::hardware_concurrency()));
  if (sched_getaffinity(0, sizeof set, &set) == 0) cores = std::max(1, CPU_COUNT(&set));
  std::ifstream groups("/proc/self/cgroup");
  for (std::string line; std::getline(groups, line);) {
    if (!line.starts_with("0::/")) continue;
    const std::filesystem::path root = "/sys/fs/cgroup";
    std::filesystem::path group = std::filesystem::path(line.substr(4)).lexically_normal();
    for (;; group = group.parent_path()) {
      if (const double quota = quota_of(root / group); quota > 0.0) cores = std::min(cores, quota);
      if (group.empty() || group == "." || group == "..") break;
    }
  }
  return cores;
}

}  // namespace gatefield::service
