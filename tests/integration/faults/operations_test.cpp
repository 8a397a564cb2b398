// What those who keep a server running see of it: the real server as a process.

#include <fcntl.h>
#include <gmock/gmock.h>
#include <google/protobuf/struct.pb.h>
#include <google/protobuf/util/json_util.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <fstream>
#include <regex>
#include <string>
#include <thread>
#include <vector>

#include "gatefield/sdk/client.h"
#include "tests/integration/race/programs.h"
#include "tests/support/http_page.h"

namespace gatefield::test {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;
using ::testing::StartsWith;
using ::testing::UnorderedElementsAre;

class Operations : public ::testing::Test {
 protected:
  void begin(std::vector<std::string> extra = {}) {
    std::filesystem::create_directory(profiles());
    std::filesystem::copy_file(kDeploy / "config/profiles/race.txt", profiles() / "race.txt");
    extra.insert(extra.end(), {"--metrics", "127.0.0.1:0"});
    auto arguments = programs_.server_arguments();
    for (std::size_t i = 0; i + 1 < arguments.size(); ++i)
      if (arguments[i] == "--profiles") arguments[i + 1] = profiles().string();
    arguments.insert(arguments.end(), extra.begin(), extra.end());
    server_.emplace((kPrograms / "gatefield-server").string(), arguments, programs_.file("server.log"));
    ASSERT_TRUE(server_->wait_for_output("ready: server", 60s)) << server_->output();
    const std::string said = server_->output();
    std::smatch found;
    ASSERT_TRUE(std::regex_search(said, found, std::regex("metrics: port ([0-9]+)"))) << said;
    port_ = found[1];
  }
  std::filesystem::path profiles() const { return programs_.file("profiles"); }
  std::string page(const std::string& path) const { return http_page(port_, path); }
  /// Asks until it says so. @return the last answer
  std::string page_with(const std::string& path, const std::string& words) const {
    std::string answer;
    for (int i = 0; i < 100; ++i) {
      answer = page(path);
      if (answer.find(words) != std::string::npos) break;
      std::this_thread::sleep_for(100ms);
    }
    return answer;
  }
  Result<std::unique_ptr<sdk::Client>> join(const std::string& profile) const {
    sdk::Options options;
    options.domain = static_cast<std::uint32_t>(own_domain());
    options.profile = profile;
    Waypoint gate;
    gate.p_W = Eigen::Vector3d(8, 0, 1.5);
    gate.direction_W = Eigen::Vector3d::UnitX();
    options.course.waypoints = {gate};
    options.connect_timeout = 20s;
    return sdk::Client::connect(options);
  }

  Programs programs_{"operations"};
  std::optional<Process> server_;
  std::string port_;
};

TEST_F(Operations, PagesSayHowItIs) {
  begin();
  EXPECT_THAT(page("/healthz"), StartsWith("HTTP/1.0 200"));
  EXPECT_THAT(page("/healthz"), HasSubstr("serves 0 vehicles"));
  auto client = join("race");
  ASSERT_TRUE(client.ok()) << client.error();
  for (int i = 0; i < 50; ++i) {
    (*client)->send_state(Stamp(1s) + i * Stamp(10ms), QuadrotorState());
    std::this_thread::sleep_for(10ms);
  }
  const std::string metrics = page_with("/metrics", "gatefield_vehicle_commands{vehicle=\"drone\"}");
  EXPECT_THAT(metrics, HasSubstr("gatefield_sessions 1\n"));
  EXPECT_THAT(metrics, HasSubstr("gatefield_sessions_begun_total 1\n"));
  client.value().reset();
  EXPECT_THAT(page_with("/metrics", "gatefield_sessions 0\n"), HasSubstr("gatefield_sessions 0\n"));
  const auto received = page("/metrics");
  EXPECT_EQ(received.find("gatefield_states_received_total 0\n"), std::string::npos) << "totals outlive the session";
}

TEST_F(Operations, ProfilesAreReadAgain) {
  begin();
  EXPECT_FALSE(join("mine").ok());
  std::filesystem::copy_file(profiles() / "race.txt", profiles() / "mine.txt");
  std::string text;
  {
    std::ifstream file(profiles() / "mine.txt");
    text.assign(std::istreambuf_iterator<char>(file), {});
  }
  std::ofstream(profiles() / "mine.txt") << std::regex_replace(text, std::regex("name: \"race\""), "name: \"mine\"");
  server_->signal(SIGHUP);
  ASSERT_TRUE(server_->wait_for_output("SIGHUP: profiles mine, race", 10s)) << server_->output();
  {
    const auto joined = join("mine");
    EXPECT_TRUE(joined.ok()) << joined.error();
  }
  std::ofstream(profiles() / "mine.txt") << "horizon: yes";
  server_->signal(SIGHUP);
  EXPECT_TRUE(server_->wait_for_output("the profiles stay as they are", 10s)) << server_->output();
  {
    const auto again = join("mine");
    EXPECT_TRUE(again.ok()) << again.error();
  }
  server_->signal(SIGTERM);
  EXPECT_EQ(server_->wait(20s).value_or(-1), 0) << server_->output();
}

/// A log's reader that goes away takes nobody with it.
TEST_F(Operations, ABrokenPipeDoesNotEndIt) {
  int pipe[2];
  ASSERT_EQ(pipe2(pipe, O_CLOEXEC), 0);
  std::vector<std::string> words = programs_.server_arguments();
  words.insert(words.begin(), (kPrograms / "gatefield-server").string());
  words.insert(words.end(), {"--log-level", "debug"});
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  const pid_t child = fork();
  if (child == 0) {
    dup2(pipe[1], STDERR_FILENO);
    execv(arguments[0], arguments.data());
    _exit(127);
  }
  close(pipe[1]);
  std::string said;
  std::array<char, 512> buffer{};
  for (ssize_t got; said.find("ready: server") == std::string::npos && (got = read(pipe[0], buffer.data(), 512)) > 0;)
    said.append(buffer.data(), static_cast<std::size_t>(got));
  close(pipe[0]);  // whoever writes a line now gets SIGPIPE
  const auto joined = join("race");
  EXPECT_TRUE(joined.ok()) << joined.error();
  EXPECT_FALSE(join("no-such-profile").ok());
  int status = 0;
  EXPECT_EQ(waitpid(child, &status, WNOHANG), 0) << "it ended with " << status;
  kill(child, SIGTERM);
  EXPECT_EQ(waitpid(child, &status, 0), child);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << status;
}

TEST_F(Operations, LogsForMachinesAreJsonLines) {
  begin({"--log-format", "json"});
  std::ifstream log(programs_.file("server.log"));
  int lines = 0;
  for (std::string line; std::getline(log, line); ++lines) {
    google::protobuf::Struct said;
    ASSERT_TRUE(google::protobuf::util::JsonStringToMessage(line, &said).ok()) << line;
    std::vector<std::string> names;
    for (const auto& [name, value] : said.fields()) names.push_back(name);
    EXPECT_THAT(names, UnorderedElementsAre("time", "level", "program", "message")) << line;
  }
  EXPECT_GT(lines, 2);
}

TEST(OperationsArguments, AnAddressThatIsNoneEndsItInWords) {
  Programs programs("operations-arguments");
  Process server = programs.server("server.log", {"--metrics", "localhost"});
  EXPECT_EQ(server.wait(30s).value_or(-1), 2);
  EXPECT_THAT(server.output(), HasSubstr("--metrics is \"localhost\", expected HOST:PORT"));
}

}  // namespace
}  // namespace gatefield::test
