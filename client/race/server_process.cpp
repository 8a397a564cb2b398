#include "client/race/server_process.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <sstream>
#include <thread>

namespace gatefield::race {
namespace {

using namespace std::chrono_literals;
namespace fs = std::filesystem;

constexpr auto kPoll = 20ms;
constexpr auto kGraceful = 2000ms;
constexpr const char* kReady = "ready: server";

}  // namespace

Result<std::unique_ptr<ServerProcess>> ServerProcess::start(const std::vector<std::string>& arguments,
                                                            const fs::path& log, std::chrono::milliseconds limit,
                                                            const std::atomic<bool>& cancel) {
  std::error_code failure;
  if (log.has_parent_path()) fs::create_directories(log.parent_path(), failure);
  const int output = ::open(log.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
  if (output < 0)
    return Error{log.string() + ": can't be written (" + std::strerror(errno) +
                 "), expected a folder that this user may write to"};
  const std::uintmax_t begin = fs::file_size(log, failure);

  // All that allocates comes before the fork: the child of a program with threads may only make system calls.
  std::vector<char*> words;
  for (const std::string& argument : arguments) words.push_back(const_cast<char*>(argument.c_str()));
  words.push_back(nullptr);
  const pid_t parent = ::getpid();
  sigset_t none;
  sigemptyset(&none);
  const pid_t pid = ::fork();
  if (pid < 0) {
    ::close(output);
    return Error{std::string("no process can be started (") + std::strerror(errno) + ")"};
  }
  if (pid == 0) {
    ::setpgid(0, 0);
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (::getppid() != parent) ::_exit(127);  // we died before the line above
    ::sigprocmask(SIG_SETMASK, &none, nullptr);
    const int input = ::open("/dev/null", O_RDONLY);
    ::dup2(input, STDIN_FILENO);
    ::dup2(output, STDOUT_FILENO);
    ::dup2(output, STDERR_FILENO);
    ::execvp(words[0], words.data());
    const char* why = std::strerror(errno);
    [[maybe_unused]] const ssize_t said = ::write(STDERR_FILENO, why, std::strlen(why));
    ::_exit(127);
  }
  ::close(output);
  std::unique_ptr<ServerProcess> server(new ServerProcess(pid, log, begin));

  const auto end = std::chrono::steady_clock::now() + limit;
  while (server->said().find(kReady) == std::string::npos) {
    if (!server->alive())
      return Error{arguments[0] + " ended with code " + std::to_string(server->code()) +
                   " before it was ready: " + server->words()};
    if (cancel) return Error{"interrupted while a server started"};
    if (std::chrono::steady_clock::now() >= end)
      return Error{arguments[0] + " was not ready within " + std::to_string(limit.count() / 1000) +
                   " s, its last words (in " + log.string() + "): " + server->words()};
    std::this_thread::sleep_for(kPoll);
  }
  return server;
}

ServerProcess::~ServerProcess() {
  if (!alive()) return;
  ::kill(pid_, SIGTERM);
  const auto end = std::chrono::steady_clock::now() + kGraceful;
  while (alive()) {
    if (std::chrono::steady_clock::now() >= end) {
      ::kill(pid_, SIGKILL);
      ::waitpid(pid_, nullptr, 0);
      return;
    }
    std::this_thread::sleep_for(kPoll);
  }
}

bool ServerProcess::alive() {
  const std::lock_guard lock(mutex_);
  if (ended_) return false;
  int status = 0;
  const pid_t changed = ::waitpid(pid_, &status, WNOHANG);
  if (changed == 0 || (changed < 0 && errno == EINTR)) return true;
  ended_ = true;
  code_ = changed < 0 ? -1 : WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  return false;
}

int ServerProcess::code() {
  alive();
  const std::lock_guard lock(mutex_);
  return code_;
}

std::string ServerProcess::said() const {
  std::ifstream in(log_, std::ios::binary);
  in.seekg(static_cast<std::streamoff>(log_begin_));
  std::ostringstream text;
  if (in.peek() != std::ifstream::traits_type::eof()) text << in.rdbuf();
  return text.str();
}

std::string ServerProcess::words() const {
  std::string text = said();
  while (!text.empty() && text.back() == '\n') text.pop_back();
  const std::size_t begin = text.rfind('\n');
  return begin == std::string::npos ? text : text.substr(begin + 1);
}

}  // namespace gatefield::race
