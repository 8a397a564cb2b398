#pragma once

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cstdint>
#include <filesystem>
#include <string>

namespace gatefield::test {

/// A DDS domain for this process, so that tests that run at the same time don't hear each other: the first free one,
/// locked until the process ends. 10 to 99: the ports stay below the range that the system gives to outgoing sockets.
/// A process that forks children for its domain calls this before it forks.
inline std::uint32_t own_domain() {
  constexpr std::uint32_t kFirst = 10;
  constexpr std::uint32_t kCount = 90;
  static const std::uint32_t domain = [] {
    const auto begin = static_cast<std::uint32_t>(getpid());
    for (std::uint32_t i = 0; i < kCount; ++i) {
      const std::uint32_t candidate = kFirst + (begin + i) % kCount;
      const auto file = std::filesystem::temp_directory_path() / ("gatefield-test-domain-" + std::to_string(candidate));
      const int lock = open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
      if (lock < 0) continue;
      if (flock(lock, LOCK_EX | LOCK_NB) == 0) return candidate;  // the descriptor stays open, and with it the lock
      close(lock);
    }
    return kFirst + begin % kCount;  // more tests than domains
  }();
  return domain;
}

}  // namespace gatefield::test
