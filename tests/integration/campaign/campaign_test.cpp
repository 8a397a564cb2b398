// gatefield-race with the real server: a small campaign, interrupted, gone on with, repeated bit for bit.

#include <dirent.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>
#include <fstream>
#include <map>
#include <thread>

#include "client/race/trial_log.h"
#include "client/race/trial_table.h"
#include "tests/integration/race/programs.h"

namespace gatefield::test {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

class Campaign : public testing::Test {
 protected:
  Campaign() : folder_(fresh_folder("campaign")) {}
  ~Campaign() override { std::filesystem::remove_all(folder_); }

  Process race(const std::string& log, const std::vector<std::string>& arguments) const {
    return Process((kPrograms / "gatefield-race").string(), arguments, folder_ / log);
  }
  std::filesystem::path out(const std::string& name) const { return folder_ / name; }

  std::vector<race::TrialResult> results(const std::string& name) const {
    const auto all = race::read_trials(out(name));
    EXPECT_TRUE(all.ok()) << all.error();
    return all.ok() ? *all : std::vector<race::TrialResult>{};
  }

  /// By trial, all columns but those that the wall clock and the machine decide.
  std::map<std::string, std::string> flights(const std::string& name) const {
    std::map<std::string, std::string> lines;
    for (race::TrialResult result : results(name)) {
      result.round_trip_p50_ms = result.round_trip_p99_ms = result.solve_p50_ms = result.wall_s = 0;
      result.attempts = 1;
      lines[race::trial_name(result)] = race::csv_line(result);
    }
    return lines;
  }

  std::filesystem::path folder_;
};

/// The servers that a process has started and that still run.
std::vector<pid_t> servers_of(pid_t parent) {
  std::vector<pid_t> found;
  for (const auto& entry : std::filesystem::directory_iterator("/proc")) {
    std::ifstream in(entry.path() / "stat");
    std::string pid, name, state;
    pid_t ppid = 0;
    if (in >> pid >> name >> state >> ppid && ppid == parent && name.starts_with("(gatefield-serv"))
      found.push_back(static_cast<pid_t>(std::stol(pid)));
  }
  return found;
}

template <typename Condition>
bool eventually(const Condition& condition, std::chrono::seconds limit) {
  const auto end = std::chrono::steady_clock::now() + limit;
  while (std::chrono::steady_clock::now() < end) {
    if (condition()) return true;
    std::this_thread::sleep_for(20ms);
  }
  return false;
}

/// Our child that runs this program; waits for it, as a child that has just been started still bears our own name.
pid_t child_of_ours(const std::string& program) {
  pid_t found = -1;
  const auto look = [&] {
    for (const auto& entry : std::filesystem::directory_iterator("/proc")) {
      std::ifstream in(entry.path() / "stat");
      std::string pid, name, state;
      pid_t ppid = 0;
      if (in >> pid >> name >> state >> ppid && ppid == getpid() && name == "(" + program.substr(0, 15) + ")")
        found = static_cast<pid_t>(std::stol(pid));
    }
    return found > 0;
  };
  eventually(look, 10s);
  return found;
}

TEST_F(Campaign, InterruptedAndGoneOnWithItIsTheSameAsInOneGo) {
  // In one go.
  Process whole = race("whole.log", {"run", "smoke", "--out", out("whole").string()});
  ASSERT_EQ(whole.wait(150s).value_or(-1), 0) << whole.output();
  EXPECT_THAT(whole.output(), HasSubstr("6 trials flown in this run, 6 of them won"));
  EXPECT_TRUE(std::filesystem::exists(out("whole") / "report/report.md"));
  EXPECT_TRUE(std::filesystem::exists(out("whole") / "report/figures/none-flights.png"));
  const auto expected = flights("whole");
  ASSERT_EQ(expected.size(), 6u);

  // Interrupted after the first trial; no server is left behind.
  Process first = race("first.log", {"run", "smoke", "--out", out("parts").string(), "--workers", "1"});
  const pid_t racer = child_of_ours("gatefield-race");
  ASSERT_GT(racer, 0);
  ASSERT_TRUE(eventually([this] { return !results("parts").empty(); }, 60s)) << first.output();
  const auto servers = servers_of(racer);
  EXPECT_EQ(servers.size(), 1u);
  first.signal(SIGINT);
  EXPECT_EQ(first.wait(10s).value_or(-1), 130) << first.output();
  EXPECT_THAT(first.output(), HasSubstr("the same command goes on"));
  for (const pid_t server : servers) EXPECT_NE(::kill(server, 0), 0) << "server " << server << " was left behind";
  const std::size_t flown = results("parts").size();
  EXPECT_GE(flown, 1u);
  ASSERT_LT(flown, 6u);

  // Gone on with; its server is killed in the middle, and another takes its place.
  Process rest = race("rest.log", {"run", "smoke", "--out", out("parts").string(), "--workers", "1"});
  const pid_t again = child_of_ours("gatefield-race");
  ASSERT_GT(again, 0);
  ASSERT_TRUE(eventually([&] { return results("parts").size() > flown || rest.wait(0s); }, 60s)) << rest.output();
  if (results("parts").size() < 6)
    for (const pid_t server : servers_of(again)) ::kill(server, SIGKILL);
  ASSERT_EQ(rest.wait(150s).value_or(-1), 0) << rest.output();
  EXPECT_THAT(rest.output(), HasSubstr(std::to_string(flown) + " done"));
  EXPECT_EQ(flights("parts"), expected) << "the same seed, another flight";
}

TEST_F(Campaign, ShardsOfTwoRunsMergeAndAServerOnTheNetworkFliesThem) {
  Process server((kPrograms / "gatefield-server").string(),
                 {"--domain", std::to_string(own_domain()), "--name", "pit", "--model",
                  (kDeploy / "models/race").string(), "--profiles", (kDeploy / "config/profiles").string()},
                 folder_ / "server.log");
  ASSERT_TRUE(server.wait_for_output("ready: server", 60s)) << server.output();
  for (const std::string index : {"1", "2"}) {
    Process part = race("part" + index + ".log",
                        {"run", "smoke", "--out", out("host" + index).string(), "--shard", index + "/2", "--seeds",
                         "1-1", "--server", "pit", "--domain", std::to_string(own_domain()), "--no-report"});
    ASSERT_EQ(part.wait(100s).value_or(-1), 0) << part.output() << server.output();
  }
  Process merge =
      race("merge.log", {"merge", out("host1").string(), out("host2").string(), "--out", out("all").string()});
  ASSERT_EQ(merge.wait(30s).value_or(-1), 0) << merge.output();
  EXPECT_EQ(results("all").size(), 3u);
  EXPECT_TRUE(std::filesystem::exists(out("all") / "report/table.md"));
}

TEST_F(Campaign, BaselinesFlyBesideTheFieldAndLostRacesHaveACause) {
  std::ofstream(folder_ / "beside.txt") << R"(
    defaults { scenario: "circle" perturbation { position_m: 0.8 height_m: 0 } laps: 1 seeds { first: 1 last: 1 } }
    cell { name: "field" speed_m_s: 6 rollouts: true }
    cell { name: "truth" beside: "field" perception: TRUE_POSE }
    cell { name: "blind" beside: "field" perception: NONE }
  )";
  Process program =
      race("beside.log", {"run", (folder_ / "beside.txt").string(), "--out", out("beside").string(), "--workers", "1"});
  ASSERT_EQ(program.wait(150s).value_or(-1), 0) << program.output();
  EXPECT_THAT(program.output(), HasSubstr("Perceptions beside each other"));
  std::map<std::string, race::TrialResult> by_cell;
  for (const race::TrialResult& result : results("beside")) by_cell[result.cell] = result;
  ASSERT_EQ(by_cell.size(), 3u);
  EXPECT_TRUE(by_cell["truth"].won()) << by_cell["truth"].sentence;
  EXPECT_FALSE(by_cell["blind"].won()) << "the gates stand 0.8 m beside their waypoints";
  EXPECT_EQ(by_cell["blind"].cause, race::Cause::kSeenTooLate) << race::name(by_cell["blind"].cause);
  for (const char* file : {"failures/blind-6-1-end.png", "rollouts/field-6-1-all.png",
                           "rollouts/field-6-1-approach.png", "report/causes.md", "report/perceptions.csv"})
    EXPECT_TRUE(std::filesystem::exists(out("beside") / file)) << file;
  EXPECT_TRUE(std::filesystem::is_empty(out("beside") / "traces")) << "traces are read and gone";

  Process refused = race("net.log", {"run", (folder_ / "beside.txt").string(), "--out", out("net").string(), "--server",
                                     "pit", "--domain", std::to_string(own_domain())});
  EXPECT_EQ(refused.wait(20s).value_or(-1), 2);
  EXPECT_THAT(refused.output(), HasSubstr("cell 'truth': perception is TRUE_POSE, expected LEARNED"));
}

TEST_F(Campaign, BadInputIsSaidBeforeAnythingStarts) {
  const auto refused = [this](const std::vector<std::string>& arguments) {
    Process program = race("refused.log", arguments);
    EXPECT_EQ(program.wait(20s).value_or(-1), 2) << program.output();
    return program.output();
  };
  EXPECT_THAT(refused({"run", "smock", "--out", out("x").string()}),
              HasSubstr("one of: hard, paper, public, rates, readme, smoke, vehicles"));
  EXPECT_THAT(refused({"run", "smoke", "--out", out("x").string(), "--shard", "3/2"}), HasSubstr("INDEX/COUNT"));
  EXPECT_THAT(refused({"run", "smoke", "--out", out("x").string(), "--profiles", "/nowhere"}),
              HasSubstr("profile is 'race'"));
  EXPECT_THAT(refused({"run", "smoke", "--out", out("x").string(), "--server-program", "/nowhere/server"}),
              HasSubstr("/nowhere/server"));
  EXPECT_THAT(refused({"report", "/nowhere"}), HasSubstr("/nowhere/campaign.txt"));
}

}  // namespace
}  // namespace gatefield::test
