#pragma once

#include <chrono>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/base/child_process.h"

namespace gatefield::test {

/// A program of ours as a child process, its output in a file. Killed when it goes out of scope, so that no test leaves
/// one behind.
class Process {
 public:
  /// @param program  path of the executable
  /// @param output   file that stdout and stderr go to
  /// Throws std::runtime_error when it can't be started.
  Process(const std::string& program, const std::vector<std::string>& arguments, const std::filesystem::path& output);

  pid_t pid() const noexcept { return child_->pid(); }
  void signal(int number) { child_->signal(number); }
  /// Exit code (128 + signal when killed), or nothing when it still runs after `timeout`.
  std::optional<int> wait(std::chrono::milliseconds timeout);
  bool running() { return child_->running(); }

  /// Everything it has written up to now.
  std::string output() const { return child_->said(); }
  /// Waits until the output contains `text`. @return false on time-out or when the process ended without it
  bool wait_for_output(const std::string& text, std::chrono::milliseconds timeout) {
    return child_->wait_for_words(text, timeout);
  }

 private:
  std::unique_ptr<ChildProcess> child_;
};

}  // namespace gatefield::test
