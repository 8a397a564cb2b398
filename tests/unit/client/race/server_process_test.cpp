#include "client/race/server_process.h"

#include <gmock/gmock.h>
#include <signal.h>

#include "tests/unit/client/race/fixtures.h"

namespace gatefield::race {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

class Server : public testing::Test {
 protected:
  auto start(const std::string& script, std::chrono::milliseconds limit = 10s) {
    return start_server({"/bin/sh", "-c", script}, folder_.path() / "logs/server.log", limit, cancel_);
  }
  Folder folder_;
  std::atomic<bool> cancel_{false};
};

TEST_F(Server, IsReadyWhenItSaysSoAndEndsWithItsOwner) {
  pid_t pid = 0;
  {
    auto server = start("echo '[info] ready: server x'; exec sleep 60");
    ASSERT_TRUE(server.ok()) << server.error();
    EXPECT_TRUE(server.value()->running());
    pid = server.value()->pid();
    EXPECT_EQ(::kill(pid, 0), 0);
  }
  EXPECT_NE(::kill(pid, 0), 0);
}

TEST_F(Server, OneThatEndsAtOnceGivesItsLastWords) {
  const auto server = start("echo one; echo 'model: no such folder' >&2; exit 2");
  ASSERT_FALSE(server.ok());
  EXPECT_EQ(server.failure().code, ErrorCode::kInvalid) << "another start would not cure it";
  EXPECT_THAT(server.error(), HasSubstr("ended with code 2 "));
  EXPECT_THAT(server.error(), HasSubstr("model: no such folder"));
}

TEST_F(Server, OneThatDiesOfSomethingElseMayBeTriedAgain) {
  EXPECT_EQ(start("exit 1").failure().code, ErrorCode::kNotAnswering);
  EXPECT_EQ(start("kill -9 $$").failure().code, ErrorCode::kNotAnswering);
}

TEST_F(Server, OneThatNeverGetsReadyIsGivenUp) {
  const auto server = start("echo loading; exec sleep 60", 200ms);
  ASSERT_FALSE(server.ok());
  EXPECT_EQ(server.failure().code, ErrorCode::kNotAnswering);
  EXPECT_THAT(server.error(), HasSubstr("not ready"));
}

TEST_F(Server, NobodyWaitsAfterAnInterrupt) {
  cancel_ = true;
  EXPECT_THAT(start("exec sleep 60").error(), HasSubstr("interrupted"));
}

TEST_F(Server, ADeathIsSeen) {
  auto server = start("echo ready: server x; exec sleep 60");
  ASSERT_TRUE(server.ok());
  ::kill(server.value()->pid(), SIGKILL);
  const auto end = server.value()->wait(10s);
  ASSERT_TRUE(end);
  EXPECT_EQ(end->signal, SIGKILL);
}

TEST_F(Server, OneThatDoesNotListenIsKilled) {
  auto server = start("trap '' TERM; echo ready: server x; while :; do sleep 1; done");
  ASSERT_TRUE(server.ok());
  const pid_t pid = server.value()->pid();
  const auto begin = std::chrono::steady_clock::now();
  server.value().reset();
  EXPECT_LT(std::chrono::steady_clock::now() - begin, 10s);
  EXPECT_NE(::kill(pid, 0), 0);
}

TEST_F(Server, AProgramThatIsNotThereIsSaid) {
  const auto server = start_server({"/nowhere/gatefield-server"}, folder_.path() / "log", 5s, cancel_);
  ASSERT_FALSE(server.ok());
  EXPECT_EQ(server.failure().code, ErrorCode::kUnreadable);
  EXPECT_THAT(server.error(), HasSubstr("No such file"));
}

}  // namespace
}  // namespace gatefield::race
