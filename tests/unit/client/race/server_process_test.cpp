#include "client/race/server_process.h"

#include <gmock/gmock.h>
#include <signal.h>

#include <thread>

#include "tests/unit/client/race/fixtures.h"

namespace gatefield::race {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

class Process : public testing::Test {
 protected:
  auto start(const std::string& script, std::chrono::milliseconds limit = 10s) {
    return ServerProcess::start({"/bin/sh", "-c", script}, folder_.path() / "logs/server.log", limit, cancel_);
  }
  Folder folder_;
  std::atomic<bool> cancel_{false};
};

TEST_F(Process, IsReadyWhenItSaysSoAndEndsWithItsOwner) {
  pid_t pid = 0;
  {
    auto server = start("echo '[info] ready: server x'; exec sleep 60");
    ASSERT_TRUE(server.ok()) << server.error();
    EXPECT_TRUE(server.value()->alive());
    pid = server.value()->pid();
    EXPECT_EQ(::kill(pid, 0), 0);
  }
  EXPECT_NE(::kill(pid, 0), 0);
}

TEST_F(Process, OneThatEndsAtOnceGivesItsLastWords) {
  const auto server = start("echo one; echo 'model: no such folder' >&2; exit 2");
  ASSERT_FALSE(server.ok());
  EXPECT_THAT(server.error(), HasSubstr("ended with code 2 "));
  EXPECT_THAT(server.error(), HasSubstr("model: no such folder"));
}

TEST_F(Process, OneThatNeverGetsReadyIsGivenUp) {
  EXPECT_THAT(start("echo loading; exec sleep 60", 200ms).error(), HasSubstr("not ready"));
}

TEST_F(Process, NobodyWaitsAfterAnInterrupt) {
  cancel_ = true;
  EXPECT_THAT(start("exec sleep 60").error(), HasSubstr("interrupted"));
}

TEST_F(Process, ADeathIsSeen) {
  auto server = start("echo ready: server x; exec sleep 60");
  ASSERT_TRUE(server.ok());
  ::kill(server.value()->pid(), SIGKILL);
  for (int i = 0; i < 500 && server.value()->alive(); ++i) std::this_thread::sleep_for(10ms);
  EXPECT_FALSE(server.value()->alive());
  EXPECT_EQ(server.value()->code(), 128 + SIGKILL);
}

TEST_F(Process, OneThatDoesNotListenIsKilled) {
  auto server = start("trap '' TERM; echo ready: server x; while :; do sleep 1; done");
  ASSERT_TRUE(server.ok());
  const pid_t pid = server.value()->pid();
  const auto begin = std::chrono::steady_clock::now();
  server.value().reset();
  EXPECT_LT(std::chrono::steady_clock::now() - begin, 10s);
  EXPECT_NE(::kill(pid, 0), 0);
}

TEST_F(Process, AProgramThatIsNotThereIsSaid) {
  const auto server = ServerProcess::start({"/nowhere/gatefield-server"}, folder_.path() / "log", 5s, cancel_);
  ASSERT_FALSE(server.ok());
  EXPECT_THAT(server.error(), HasSubstr("code 127"));
  EXPECT_THAT(server.error(), HasSubstr("No such file"));
}

}  // namespace
}  // namespace gatefield::race
