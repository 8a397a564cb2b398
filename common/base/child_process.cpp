#include "common/base/child_process.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <system_error>
#include <thread>

extern char** environ;

namespace gatefield {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;
using namespace std::chrono_literals;

/// A descriptor that closes itself.
class Descriptor {
 public:
  explicit Descriptor(int value = -1) noexcept : value_(value) {}
  ~Descriptor() {
    if (value_ >= 0) ::close(value_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int get() const noexcept { return value_; }
  int release() noexcept { return std::exchange(value_, -1); }
  void reset(int value = -1) noexcept {
    if (value_ >= 0) ::close(value_);
    value_ = value;
  }

 private:
  int value_;
};

std::string because() { return " (" + std::string(std::strerror(errno)) + ")"; }

/// The program's file, as execvp() would find it. Empty: there is none.
std::string find_program(const std::string& name) {
  if (name.find('/') != std::string::npos) return name;
  const char* path = std::getenv("PATH");
  std::string folders = path != nullptr ? path : "/usr/local/bin:/usr/bin:/bin";
  folders += ':';
  for (std::size_t begin = 0, end; (end = folders.find(':', begin)) != std::string::npos; begin = end + 1) {
    const fs::path file = fs::path(end > begin ? folders.substr(begin, end - begin) : ".") / name;
    struct stat found {};
    if (::stat(file.c_str(), &found) == 0 && S_ISREG(found.st_mode) && ::access(file.c_str(), X_OK) == 0)
      return file.string();
  }
  return {};
}

/// "NAME=value" of all that the child shall see; the first of a name counts.
std::vector<std::string> environment_of(const ChildOptions& options) {
  std::vector<std::string> all;
  for (const auto& [name, value] : options.environment) all.push_back(name + "=" + value);
  const std::size_t own = all.size();
  for (char** entry = environ; *entry != nullptr; ++entry) {
    const std::string_view ours(*entry);
    const std::string_view name = ours.substr(0, ours.find('=') + 1);
    const bool replaced = std::any_of(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(own),
                                      [&](const std::string& one) { return one.starts_with(name); });
    if (!replaced) all.emplace_back(ours);
  }
  return all;
}

std::vector<char*> pointers(std::vector<std::string>& words) {
  std::vector<char*> out;
  for (std::string& word : words) out.push_back(word.data());
  out.push_back(nullptr);
  return out;
}

Status open_output(const ChildOptions& options, Descriptor* output) {
  if (options.log.empty()) {
    output->reset(::memfd_create("child", MFD_CLOEXEC));
    if (output->get() >= 0) ::fcntl(output->get(), F_SETFL, O_APPEND);
    return output->get() >= 0 ? Status() : Status(Error{"no process can be started" + because()});
  }
  std::error_code failure;
  if (options.log.has_parent_path()) fs::create_directories(options.log.parent_path(), failure);
  const int begin = options.append ? 0 : O_TRUNC;
  output->reset(::open(options.log.c_str(), O_RDWR | O_CREAT | O_APPEND | O_CLOEXEC | begin, 0644));
  if (output->get() >= 0) return {};
  return Error{
      options.log.string() + ": can't be written" + because() + ", expected a folder that this user may write to",
      ErrorCode::kUnreadable, "log"};
}

Status open_input(const std::string& text, Descriptor* input) {
  input->reset(text.empty() ? ::open("/dev/null", O_RDONLY | O_CLOEXEC) : ::memfd_create("input", MFD_CLOEXEC));
  std::size_t done = 0;
  while (input->get() >= 0 && done < text.size()) {
    const ssize_t wrote = ::write(input->get(), text.data() + done, text.size() - done);
    if (wrote < 0 && errno != EINTR) break;
    done += static_cast<std::size_t>(std::max<ssize_t>(wrote, 0));
  }
  if (input->get() >= 0 && done == text.size() && (text.empty() || ::lseek(input->get(), 0, SEEK_SET) == 0)) return {};
  return Error{"no process can be started" + because()};
}

/// What the child does between fork() and exec(): system calls only, since another thread of ours may hold any lock.
struct Launch {
  const char* program;
  char** arguments;
  char** environment;
  const char* folder;  ///< null: ours
  int input, output;
  int failure;  ///< pipe for what went wrong: errno, and what we were at
  pid_t parent;
};
enum Stage : int { kFolder = 1, kProgram = 2 };

[[noreturn]] void become(const Launch& launch) noexcept {
  const auto fail = [&](int stage) {
    const int told[2] = {errno, stage};
    [[maybe_unused]] const ssize_t wrote = ::write(launch.failure, told, sizeof told);
    ::_exit(127);
  };
  ::setpgid(0, 0);
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (::getppid() != launch.parent) ::_exit(127);  // we died before the line above
  // The child begins as from a terminal, whatever we ignore or block ourselves.
  for (const int number : {SIGINT, SIGTERM, SIGHUP, SIGPIPE, SIGCHLD, SIGQUIT}) ::signal(number, SIG_DFL);
  sigset_t none;
  ::sigemptyset(&none);
  ::sigprocmask(SIG_SETMASK, &none, nullptr);
  ::dup2(launch.input, STDIN_FILENO);
  ::dup2(launch.output, STDOUT_FILENO);
  ::dup2(launch.output, STDERR_FILENO);
  if (launch.folder != nullptr && ::chdir(launch.folder) != 0) fail(kFolder);
  ::execve(launch.program, launch.arguments, launch.environment);
  fail(kProgram);
  ::_exit(127);
}

Error program_error(const std::string& name, const std::string& why) {
  return Error{name + " can't be started" + why, ErrorCode::kUnreadable, "program"};
}

std::string without_line_end(std::string said) {
  while (!said.empty() && (said.back() == '\n' || said.back() == ' ')) said.pop_back();
  return said;
}

}  // namespace

std::string text(const ChildEnd& end) {
  return end.exited ? "with code " + std::to_string(end.code) : "by signal " + std::to_string(end.signal);
}

Result<std::unique_ptr<ChildProcess>> ChildProcess::start(const ChildOptions& options) {
  // All that allocates comes before the fork: the child of a program with threads may only make system calls.
  const std::string program = find_program(options.arguments.front());
  if (program.empty()) {
    errno = ENOENT;
    return program_error(options.arguments.front(), because());
  }
  std::vector<std::string> arguments = options.arguments, environment = environment_of(options);
  const std::vector<char*> argument_pointers = pointers(arguments), environment_pointers = pointers(environment);
  Descriptor input, output;
  if (Status opened = open_output(options, &output); !opened) return opened.failure();
  if (Status opened = open_input(options.input, &input); !opened) return opened.failure();
  const off_t begin = std::max<off_t>(0, ::lseek(output.get(), 0, SEEK_END));
  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0) return Error{"no process can be started" + because()};
  Descriptor told(ends[0]), tells(ends[1]);

  const Launch launch{program.c_str(),
                      const_cast<char**>(argument_pointers.data()),
                      const_cast<char**>(environment_pointers.data()),
                      options.folder.empty() ? nullptr : options.folder.c_str(),
                      input.get(),
                      output.get(),
                      tells.get(),
                      ::getpid()};
  const pid_t pid = ::fork();
  if (pid < 0) return Error{"no process can be started" + because()};
  if (pid == 0) become(launch);
  ::setpgid(pid, pid);  // here too, so that the group is there when we return; one of the two is first
  tells.reset();
  int failed[2] = {0, 0};
  ssize_t got;
  do {
    got = ::read(told.get(), failed, sizeof failed);  // ends at once when exec() closes the other side
  } while (got < 0 && errno == EINTR);
  std::unique_ptr<ChildProcess> child(new ChildProcess(pid, output.release(), begin, options.grace));
  if (got != sizeof failed) return child;
  child->stop(0ms);
  errno = failed[0];
  if (failed[1] == kFolder)
    return Error{options.folder.string() + ": no program can be started there" + because(), ErrorCode::kUnreadable,
                 "folder"};
  return program_error(options.arguments.front(), because());
}

ChildProcess::~ChildProcess() {
  stop(grace_);
  ::close(output_);
}

bool ChildProcess::reap() {
  if (end_) return true;
  siginfo_t info{};
  // Looked at before it is taken away: while it is there, its group's number can't be anybody else's.
  const bool ours = ::waitid(P_PID, static_cast<id_t>(pid_), &info, WEXITED | WNOHANG | WNOWAIT) == 0;
  if (ours ? info.si_pid == 0 : errno == EINTR) return false;
  if (ours) ::kill(-pid_, SIGKILL);
  int status = 0;
  pid_t ended;
  do {
    ended = ::waitpid(pid_, &status, 0);
  } while (ended < 0 && errno == EINTR);
  ChildEnd end;
  end.exited = ended == pid_ && WIFEXITED(status);
  end.code = end.exited ? WEXITSTATUS(status) : 0;
  end.signal = ended == pid_ && WIFSIGNALED(status) ? WTERMSIG(status) : 0;
  end.words = words();
  end_ = std::move(end);
  return true;
}

void ChildProcess::signal(int number) {
  const std::lock_guard lock(mutex_);
  if (!reap()) ::kill(pid_, number);
}

std::optional<ChildEnd> ChildProcess::wait(std::chrono::milliseconds limit) {
  const auto until = Clock::now() + limit;
  for (auto pause = 1ms;; pause = std::min(2 * pause, 20ms)) {
    {
      const std::lock_guard lock(mutex_);
      if (reap()) return end_;
    }
    const auto now = Clock::now();
    if (now >= until) return std::nullopt;
    std::this_thread::sleep_for(std::min<Clock::duration>(pause, until - now));
  }
}

bool ChildProcess::wait_for_words(std::string_view text, std::chrono::milliseconds limit,
                                  const std::atomic<bool>* cancel) {
  const auto until = Clock::now() + limit;
  while (true) {
    const bool ended = !running();  // asked first, so that its very last words count
    if (said().find(text) != std::string::npos) return true;
    if (ended || Clock::now() >= until || (cancel != nullptr && *cancel)) return false;
    wait(20ms);
  }
}

ChildEnd ChildProcess::stop(std::chrono::milliseconds grace) {
  if (grace > 0ms) {
    signal(SIGTERM);
    if (const auto end = wait(grace)) return *end;
  }
  {
    const std::lock_guard lock(mutex_);
    if (!reap()) ::kill(-pid_, SIGKILL);
  }
  return *wait(std::chrono::hours(24));
}

std::string ChildProcess::read_back(std::size_t limit) const {
  struct stat file {};
  if (::fstat(output_, &file) != 0 || file.st_size <= output_begin_) return {};
  const auto size = std::min(static_cast<std::size_t>(file.st_size - output_begin_), limit);
  std::string out(size, '\0');
  off_t at = file.st_size - static_cast<off_t>(size);
  std::size_t done = 0;
  while (done < size) {
    const ssize_t got = ::pread(output_, out.data() + done, size - done, at);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) break;
    done += static_cast<std::size_t>(got);
    at += got;
  }
  out.resize(done);
  return out;
}

std::string ChildProcess::words() const { return without_line_end(read_back(kMaxWords)); }

std::string ChildProcess::last_line() const {
  const std::string last = words();
  const std::size_t begin = last.rfind('\n');
  return begin == std::string::npos ? last : last.substr(begin + 1);
}

Result<ChildEnd> run_child(const ChildOptions& options, std::chrono::milliseconds limit) {
  auto child = ChildProcess::start(options);
  if (!child) return child.failure();
  if (auto end = child.value()->wait(limit)) return *std::move(end);
  child.value()->stop(std::chrono::milliseconds(0));
  return Error{options.arguments.front() + " took longer than " + std::to_string(limit.count()) + " ms and was stopped",
               ErrorCode::kNotAnswering};
}

}  // namespace gatefield
