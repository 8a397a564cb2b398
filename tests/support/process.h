#pragma once

#include <sys/types.h>

#include <chrono>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace gatefield::test {

/// A program of ours as a child process, its output in a file. Killed when it goes out of scope, so that no test leaves
/// one behind.
class Process {
 public:
  /// @param program  path of the executable
  /// @param output   file that stdout and stderr go to
  Process(const std::string& program, const std::vector<std::string>& arguments, const std::filesystem::path& output);
  ~Process();
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  pid_t pid() const noexcept { return pid_; }
  void signal(int number);
  /// Exit code (128 + signal when killed), or nothing when it still runs after `timeout`.
  std::optional<int> wait(std::chrono::milliseconds timeout);
  bool running() { return !wait(std::chrono::milliseconds(0)).has_value(); }

  /// Everything it has written up to now.
  std::string output() const;
  /// Waits until the output contains `text`. @return false on time-out or when the process ended without it
  bool wait_for_output(const std::string& text, std::chrono::milliseconds timeout);

 private:
  pid_t pid_ = -1;
  std::optional<int> code_;
  std::filesystem::path output_;
};

}  // namespace gatefield::test
