#pragma once

#include <sys/types.h>

#include <atomic>
#include <chrono>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/base/result.h"

namespace gatefield {

/// How a child process ended.
struct ChildEnd {
  bool exited = false;  ///< by itself, with `code`; false: killed by `signal`
  int code = 0;
  int signal = 0;
  std::string words;  ///< the last of what it said, see ChildProcess::words()

  bool well() const noexcept { return exited && code == 0; }
};

/// "with code 2", "by signal 9": for sentences about a program that ended.
std::string text(const ChildEnd& end);

struct ChildOptions {
  std::vector<std::string> arguments;  ///< program first; it is looked for on the PATH when it names no folder
  std::filesystem::path folder;        ///< that it works in; empty: ours
  std::vector<std::pair<std::string, std::string>> environment;  ///< beside and before what we have ourselves
  std::string input;                                             ///< what it reads; empty: nothing
  /// What it says, on both of its outputs, goes into this file (made, with its folder); empty: kept in memory.
  std::filesystem::path log;
  bool append = true;  ///< to what the log has already; false: the log begins anew
  /// How long the destructor and stop() wait between asking it to end (SIGTERM) and killing it; 0: killed at once.
  std::chrono::milliseconds grace{0};
};

/// A program as a child process, started without a shell: arguments reach it as they are. It leads a process group of
/// its own (a Ctrl-C at the terminal is not for it), and whatever is left of the group when it has ended is killed. It
/// is killed when the thread that started it ends, however that happens (PR_SET_PDEATHSIG counts threads, not
/// processes), so start it from a thread that lives as long as it shall.
/// Thread-safe: yes, every function may be called from any thread.   Real-time safe: no.
class ChildProcess {
 public:
  /// @pre !options.arguments.empty()
  /// Errors, told before anything runs: kUnreadable with field "program" (not there, or not to be executed), "folder"
  /// or "log"; kOther when the system has no room for another process.
  static Result<std::unique_ptr<ChildProcess>> start(const ChildOptions& options);
  /// As stop(options.grace).
  ~ChildProcess();
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  pid_t pid() const noexcept { return pid_; }
  bool running() { return !wait(std::chrono::milliseconds(0)); }
  /// Sends it a signal if it still runs.
  void signal(int number);
  /// How it ended, or nothing when it still runs after `limit`.
  std::optional<ChildEnd> wait(std::chrono::milliseconds limit);
  /// Waits until it has said `text`. False: it ended without, the time is over, or `cancel` became true.
  bool wait_for_words(std::string_view text, std::chrono::milliseconds limit,
                      const std::atomic<bool>* cancel = nullptr);
  /// Asks it to end, kills it with its group after `grace`, and says how it ended.
  ChildEnd stop(std::chrono::milliseconds grace);

  /// All that it has said up to now.
  std::string said() const { return read_back(SIZE_MAX); }
  /// The last of it, at most kMaxWords characters, without the line end.
  std::string words() const;
  /// The last line of words().
  std::string last_line() const;

  static constexpr std::size_t kMaxWords = 2000;

 private:
  ChildProcess(pid_t pid, int output, off_t output_begin, std::chrono::milliseconds grace)
      : pid_(pid), output_(output), output_begin_(output_begin), grace_(grace) {}
  std::string read_back(std::size_t limit) const;
  bool reap();

  const pid_t pid_;
  const int output_;  ///< descriptor of what it writes into
  const off_t output_begin_;
  const std::chrono::milliseconds grace_;
  std::mutex mutex_;  // guards the end, and that nobody signals a process that is gone
  std::optional<ChildEnd> end_;
};

/// Runs a program to its end, and kills it when that takes longer than `limit`.
/// Errors: as ChildProcess::start(), and kNotAnswering at the limit.
Result<ChildEnd> run_child(const ChildOptions& options, std::chrono::milliseconds limit);

}  // namespace gatefield
