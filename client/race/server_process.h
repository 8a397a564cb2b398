#pragma once

#include <sys/types.h>

#include <atomic>
#include <chrono>
#include <filesystem>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "common/base/result.h"

namespace gatefield::race {

/// A gatefield-server of our own as a child process. It is in a process group of its own (a Ctrl-C at the terminal is
/// not for it) and ends with the thread that started it, also when that one is killed.
/// Thread-safe: alive() and words() yes, the others one thread at a time.
class ServerProcess {
 public:
  /// Starts it and waits until it says that it is ready.
  /// @param arguments  program first; its folder is looked for on the PATH when it names none
  /// @param log        what it says is added to this file
  /// @param cancel     becomes true when nobody wants it any more
  /// Errors: can't be started, ended by itself (with its last words), or was not ready in time.
  static Result<std::unique_ptr<ServerProcess>> start(const std::vector<std::string>& arguments,
                                                      const std::filesystem::path& log, std::chrono::milliseconds limit,
                                                      const std::atomic<bool>& cancel);
  /// Asks it to end, and kills it after two seconds.
  ~ServerProcess();
  ServerProcess(const ServerProcess&) = delete;
  ServerProcess& operator=(const ServerProcess&) = delete;

  bool alive();
  pid_t pid() const noexcept { return pid_; }
  /// Its last line up to now.
  std::string words() const;
  /// Exit code, 128 + signal when killed; -1 while it lives.
  int code();

 private:
  ServerProcess(pid_t pid, std::filesystem::path log, std::uintmax_t log_begin)
      : pid_(pid), log_(std::move(log)), log_begin_(log_begin) {}
  std::string said() const;

  pid_t pid_;
  std::filesystem::path log_;
  std::uintmax_t log_begin_;
  std::mutex mutex_;  // the two that follow
  bool ended_ = false;
  int code_ = -1;
};

}  // namespace gatefield::race
