#include "common/base/child_process.h"

#include <gmock/gmock.h>
#include <signal.h>
#include <unistd.h>

#include <fstream>
#include <sstream>
#include <thread>

namespace gatefield {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

ChildOptions shell(const std::string& script) {
  ChildOptions options;
  options.arguments = {"sh", "-c", script};
  return options;
}

bool gone(pid_t pid) {
  for (int i = 0; i < 500; ++i) {
    std::ifstream status("/proc/" + std::to_string(pid) + "/stat");
    std::string number, name, state;
    if (!(status >> number >> name >> state) || state == "Z") return true;
    std::this_thread::sleep_for(10ms);
  }
  return false;
}

TEST(RunChild, GivesExitCodeAndWords) {
  ChildOptions options = shell("pwd >&2; exit 3");
  options.folder = "/";
  const auto end = run_child(options, 10s);
  ASSERT_TRUE(end.ok()) << end.error();
  EXPECT_TRUE(end->exited);
  EXPECT_FALSE(end->well());
  EXPECT_EQ(end->code, 3);
  EXPECT_EQ(end->words, "/");
  EXPECT_EQ(text(*end), "with code 3");
}

TEST(RunChild, TellsASignalFromACode) {
  const auto end = run_child(shell("kill -9 $$"), 10s);
  ASSERT_TRUE(end.ok());
  EXPECT_FALSE(end->exited);
  EXPECT_EQ(end->signal, SIGKILL);
  EXPECT_EQ(text(*end), "by signal 9");
}

TEST(RunChild, ArgumentsAreNoShellWords) {
  ChildOptions options = shell("printf %s \"$1\" >&2");
  options.arguments.insert(options.arguments.end(), {"sh", "$(echo no); `x` 'y'"});
  EXPECT_EQ(run_child(options, 10s)->words, "$(echo no); `x` 'y'");
}

TEST(RunChild, InputAndEnvironmentAreWhatWasGiven) {
  ChildOptions options = shell("cat; echo \"$GATEFIELD_A $HOME ${PATH:+has a path}\"");
  options.input = std::string(200'000, 'x') + "\n";
  options.environment = {{"GATEFIELD_A", "b=c"}, {"HOME", "/nowhere"}};
  auto child = ChildProcess::start(options);
  ASSERT_TRUE(child.ok()) << child.error();
  ASSERT_TRUE(child.value()->wait(10s));
  EXPECT_EQ(child.value()->said().size(), 200'001u + std::string("b=c /nowhere has a path\n").size());
  EXPECT_EQ(child.value()->last_line(), "b=c /nowhere has a path");
  EXPECT_EQ(run_child(shell("cat; echo end"), 10s)->words, "end") << "without input it reads nothing";
}

TEST(RunChild, ManyWordsDoNotHoldItUpAndTheLastOnesCount) {
  const auto end = run_child(shell("head -c 300000 /dev/zero | tr '\\0' x; echo y"), 20s);
  ASSERT_TRUE(end.ok()) << end.error();
  EXPECT_LE(end->words.size(), ChildProcess::kMaxWords);
  EXPECT_THAT(end->words, testing::EndsWith("xy"));
}

TEST(RunChild, StopsWhatTakesTooLong) {
  const auto begun = std::chrono::steady_clock::now();
  const auto end = run_child(shell("sleep 60"), 100ms);
  ASSERT_FALSE(end.ok());
  EXPECT_EQ(end.failure().code, ErrorCode::kNotAnswering);
  EXPECT_LT(std::chrono::steady_clock::now() - begun, 20s);
}

TEST(RunChild, SaysWhatCantBeStartedBeforeAnythingRuns) {
  const auto field_of = [](const ChildOptions& options) {
    const auto end = run_child(options, 10s);
    EXPECT_FALSE(end.ok());
    EXPECT_EQ(end.failure().code, ErrorCode::kUnreadable) << end.error();
    return end.failure().field;
  };
  ChildOptions options;
  options.arguments = {"no-such-program-anywhere"};
  EXPECT_EQ(field_of(options), "program");
  options.arguments = {"/nowhere/program"};
  EXPECT_EQ(field_of(options), "program");
  options.arguments = {"/dev/null"};
  EXPECT_EQ(field_of(options), "program");
  options = shell("true");
  options.folder = "/no/such/folder";
  EXPECT_EQ(field_of(options), "folder");
  options = shell("true");
  options.log = "/proc/nowhere/log";
  EXPECT_EQ(field_of(options), "log");
}

TEST(ChildProcess, IsFollowedWhileItSpeaks) {
  auto child = ChildProcess::start(shell("echo one; echo ready; exec sleep 60"));
  ASSERT_TRUE(child.ok()) << child.error();
  EXPECT_TRUE(child.value()->wait_for_words("ready\n", 10s));
  EXPECT_TRUE(child.value()->running());
  EXPECT_EQ(child.value()->last_line(), "ready");
  EXPECT_FALSE(child.value()->wait_for_words("never", 50ms));
  std::atomic<bool> cancel{true};
  EXPECT_FALSE(child.value()->wait_for_words("never", 60s, &cancel));
}

TEST(ChildProcess, WordsOfOneThatEndedAreAllThere) {
  auto child = ChildProcess::start(shell("echo at last; exit 1"));
  ASSERT_TRUE(child.ok());
  EXPECT_TRUE(child.value()->wait_for_words("at last", 10s));
  EXPECT_FALSE(child.value()->wait_for_words("more", 60s)) << "it has ended: nobody waits";
}

TEST(ChildProcess, ALogIsAddedToOrBeginsAnew) {
  const fs::path folder = fs::temp_directory_path() / ("gatefield-child-" + std::to_string(::getpid()));
  ChildOptions options;
  options.log = folder / "logs" / "log";
  const auto content = [&] {
    std::ostringstream text;
    text << std::ifstream(options.log).rdbuf();
    return text.str();
  };
  for (const char* word : {"a", "b"}) {
    options.arguments = {"echo", word};
    const auto end = run_child(options, 10s);
    ASSERT_TRUE(end.ok()) << end.error();
    EXPECT_EQ(end->words, word) << "what stood there before was said by another";
  }
  EXPECT_EQ(content(), "a\nb\n");
  options.append = false;
  ASSERT_TRUE(run_child(options, 10s).ok());
  EXPECT_EQ(content(), "b\n");
  fs::remove_all(folder);
}

TEST(ChildProcess, EndsWithItsOwner) {
  pid_t pid = 0;
  {
    auto child = ChildProcess::start(shell("exec sleep 60"));
    ASSERT_TRUE(child.ok());
    pid = child.value()->pid();
    EXPECT_EQ(::kill(pid, 0), 0);
  }
  EXPECT_NE(::kill(pid, 0), 0);
}

TEST(ChildProcess, TakesItsGroupWithIt) {
  auto child = ChildProcess::start(shell("sleep 60 & echo $!; exit 0"));
  ASSERT_TRUE(child.ok());
  ASSERT_TRUE(child.value()->wait(10s));
  EXPECT_TRUE(gone(std::stoi(child.value()->said())));
}

TEST(ChildProcess, IsAskedBeforeItIsKilled) {
  auto listens = ChildProcess::start(shell("trap 'exit 7' TERM; echo ready; while :; do sleep 0.05; done"));
  ASSERT_TRUE(listens.ok());
  ASSERT_TRUE(listens.value()->wait_for_words("ready", 10s));
  EXPECT_EQ(listens.value()->stop(20s).code, 7);
  auto deaf = ChildProcess::start(shell("trap '' TERM; echo ready; while :; do sleep 0.05; done"));
  ASSERT_TRUE(deaf.ok());
  ASSERT_TRUE(deaf.value()->wait_for_words("ready", 10s));
  EXPECT_EQ(deaf.value()->stop(100ms).signal, SIGKILL);
}

TEST(ChildProcess, EndsWithTheThreadThatStartedIt) {
  Result<std::unique_ptr<ChildProcess>> child = Error{"none yet"};
  std::thread([&] { child = ChildProcess::start(shell("exec sleep 60")); }).join();
  ASSERT_TRUE(child.ok()) << child.error();
  const auto end = child.value()->wait(20s);
  ASSERT_TRUE(end);
  EXPECT_EQ(end->signal, SIGKILL);
}

TEST(ChildProcess, IsAskedFromManyThreadsAtOnce) {
  auto child = ChildProcess::start(shell("sleep 0.1; exit 5"));
  ASSERT_TRUE(child.ok());
  std::vector<std::thread> threads;
  for (int i = 0; i < 4; ++i)
    threads.emplace_back([&] {
      const auto end = child.value()->wait(20s);
      ASSERT_TRUE(end);
      EXPECT_EQ(end->code, 5);
      child.value()->signal(SIGTERM);  // to nobody: it is gone
    });
  for (std::thread& thread : threads) thread.join();
}

}  // namespace
}  // namespace gatefield
