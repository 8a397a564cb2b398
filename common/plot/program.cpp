#include "common/plot/program.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <thread>

extern char** environ;

namespace gatefield::plot {
namespace {

using Clock = std::chrono::steady_clock;
constexpr std::size_t kMostWords = 2000;

int left_ms(Clock::time_point end) {
  return static_cast<int>(
      std::max<std::int64_t>(0, std::chrono::duration_cast<std::chrono::milliseconds>(end - Clock::now()).count()));
}

/// Reads until the other side closes or the time is over.
std::string read_words(int descriptor, Clock::time_point end) {
  std::string words;
  char buffer[512];
  while (true) {
    pollfd waiting{descriptor, POLLIN, 0};
    const int ready = ::poll(&waiting, 1, left_ms(end));
    if (ready < 0 && errno == EINTR) continue;
    if (ready <= 0) break;
    const ssize_t got = ::read(descriptor, buffer, sizeof buffer);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) break;
    // Read on when enough was kept: a full pipe would hold the program up.
    words.append(buffer, std::min(static_cast<std::size_t>(got), kMostWords - words.size()));
  }
  while (!words.empty() && (words.back() == '\n' || words.back() == ' ')) words.pop_back();
  return words;
}

}  // namespace

ProgramEnd run_program(const std::vector<std::string>& arguments, const std::filesystem::path& folder,
                       std::chrono::milliseconds limit) {
  ProgramEnd out;
  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0) {
    out.words = std::strerror(errno);
    return out;
  }
  std::vector<char*> words;
  for (const std::string& argument : arguments) words.push_back(const_cast<char*>(argument.c_str()));
  words.push_back(nullptr);

  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
  posix_spawn_file_actions_adddup2(&actions, ends[1], STDERR_FILENO);
  if (!folder.empty()) posix_spawn_file_actions_addchdir_np(&actions, folder.c_str());
  pid_t child = 0;
  const int failed = ::posix_spawnp(&child, words[0], &actions, nullptr, words.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  ::close(ends[1]);
  if (failed != 0) {
    ::close(ends[0]);
    std::error_code code;
    const bool has_folder = folder.empty() || std::filesystem::is_directory(folder, code);
    if (failed == ENOENT && has_folder) out.kind = ProgramEnd::Kind::kNotFound;
    out.words = std::strerror(failed);
    return out;
  }

  const auto end = Clock::now() + limit;
  out.words = read_words(ends[0], end);
  ::close(ends[0]);
  int status = 0;
  while (true) {
    const pid_t ended = ::waitpid(child, &status, WNOHANG);
    if (ended == child) break;
    if (ended < 0 && errno != EINTR) {
      out.words = std::strerror(errno);
      return out;
    }
    if (Clock::now() >= end) {
      ::kill(child, SIGKILL);
      while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
      }
      out.kind = ProgramEnd::Kind::kTooLong;
      return out;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  out.kind = WIFEXITED(status) ? ProgramEnd::Kind::kExited : ProgramEnd::Kind::kKilled;
  out.code = WIFEXITED(status) ? WEXITSTATUS(status) : WTERMSIG(status);
  return out;
}

}  // namespace gatefield::plot
