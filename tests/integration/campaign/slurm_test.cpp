// A campaign as an array of Slurm tasks: a Slurm of this test's own (one node, this machine) flies the shards by the
// batch script that ships, one of them is sent away in the middle, and what comes out is what one run flies.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <map>
#include <memory>
#include <thread>

#include "client/race/trial_log.h"
#include "client/race/trial_table.h"
#include "tests/integration/race/programs.h"

namespace gatefield::test {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

std::string host() {
  char name[256] = {};
  gethostname(name, sizeof name - 1);
  const std::string whole = name;
  return whole.substr(0, whole.find('.'));
}

/// Slurm's two daemons with a configuration of their own, as long as this lives.
class Slurm {
 public:
  explicit Slurm(const std::filesystem::path& folder) : folder_(folder) {
    for (const char* part : {"state", "spool"}) std::filesystem::create_directories(folder / part);
    // Ports by process, so that another one's daemons are not met. A task that was sent away may begin again at once.
    const int port = 20000 + 2 * static_cast<int>(getpid() % 5000);
    std::ofstream(folder / "slurm.conf")
        << "ClusterName=gatefield\nSlurmctldHost=" << host() << "(127.0.0.1)\nSlurmctldPort=" << port
        << "\nSlurmdPort=" << port + 1 << "\nAuthType=auth/none\nCredType=cred/none\nAuthInfo=cred_expire=5\n"
        << "SlurmUser=root\nSlurmdUser=root\nStateSaveLocation=" << (folder / "state").string()
        << "\nSlurmdSpoolDir=" << (folder / "spool").string()
        << "\nSlurmctldPidFile=" << (folder / "slurmctld.pid").string()
        << "\nSlurmdPidFile=" << (folder / "slurmd.pid").string()
        << "\nProctrackType=proctrack/linuxproc\nTaskPlugin=task/none\nSelectType=select/cons_tres\n"
        << "SelectTypeParameters=CR_CPU\nSwitchType=switch/none\nMpiDefault=none\nReturnToService=2\nKillWait=15\n"
        << "SlurmdParameters=config_overrides\nAccountingStorageType=accounting_storage/none\n"
        << "JobAcctGatherType=jobacct_gather/none\nNodeName=" << host()
        << " NodeAddr=127.0.0.1 CPUs=2 State=UNKNOWN\nPartitionName=race Nodes=" << host()
        << " Default=YES MaxTime=INFINITE State=UP\n";
    setenv("SLURM_CONF", (folder / "slurm.conf").c_str(), 1);
    controller_ = std::make_unique<Process>("/usr/sbin/slurmctld",
                                            std::vector<std::string>{"-D", "-f", (folder / "slurm.conf").string()},
                                            folder / "slurmctld.log");
    node_ = std::make_unique<Process>(
        "/usr/sbin/slurmd", std::vector<std::string>{"-D", "-f", (folder / "slurm.conf").string(), "-N", host()},
        folder / "slurmd.log");
  }

  /// One of Slurm's commands, and its words.
  std::string ask(const std::string& command, const std::vector<std::string>& arguments) const {
    Process program("/usr/bin/" + command, arguments, folder_ / (command + ".log"));
    program.wait(20s);
    return program.output();
  }
  std::string daemons() const { return controller_->output() + node_->output(); }

 private:
  std::filesystem::path folder_;
  std::unique_ptr<Process> controller_, node_;
};

template <typename Condition>
bool eventually(const Condition& condition, std::chrono::seconds limit) {
  const auto end = std::chrono::steady_clock::now() + limit;
  while (std::chrono::steady_clock::now() < end) {
    if (condition()) return true;
    std::this_thread::sleep_for(100ms);
  }
  return false;
}

std::vector<race::TrialResult> results(const std::filesystem::path& folder) {
  const auto all = race::read_trials(folder);
  return all.ok() ? *all : std::vector<race::TrialResult>{};
}

/// Of each trial the flight, bit for bit.
std::map<std::string, std::uint64_t> flights(const std::filesystem::path& folder) {
  std::map<std::string, std::uint64_t> found;
  for (const race::TrialResult& result : results(folder)) found[race::trial_name(result)] = result.flight;
  return found;
}

std::string words_of(const std::filesystem::path& file) {
  std::ifstream in(file);
  return {std::istreambuf_iterator<char>(in), {}};
}

std::size_t lines_of_trials(const std::filesystem::path& folder) {
  std::size_t lines = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (!entry.path().filename().string().starts_with("trials")) continue;
    const std::string words = words_of(entry.path());
    lines += static_cast<std::size_t>(std::count(words.begin(), words.end(), '\n'));
  }
  return lines;
}

TEST(CampaignOverSlurm, AnArrayOfShardsIsTheSameCampaign) {
  if (geteuid() != 0) GTEST_SKIP() << "a Slurm node of one's own needs root";
  const auto folder = fresh_folder("slurm");
  Process whole((kPrograms / "gatefield-race").string(),
                {"run", "smoke", "--out", (folder / "whole").string(), "--no-report"}, folder / "whole.log");
  ASSERT_EQ(whole.wait(150s).value_or(-1), 0) << whole.output();

  const Slurm slurm(folder);
  ASSERT_TRUE(eventually([&] { return slurm.ask("sinfo", {"-h", "-o", "%t"}) == "idle\n"; }, 60s)) << slurm.daemons();
  setenv("GATEFIELD_RACE", (kPrograms / "gatefield-race").c_str(), 1);
  const std::string answer = slurm.ask(
      "sbatch", {"--parsable", "--array=1-2", "--cpus-per-task=1", "--output=" + (folder / "task-%a.log").string(),
                 (kDeploy / "slurm/campaign.sbatch").string(), "smoke", folder.string()});
  const std::string job = answer.substr(0, answer.find('\n'));
  ASSERT_GT(std::atoi(job.c_str()), 0) << answer << slurm.daemons();

  // The first shard is sent away after its first flight, and comes back.
  const auto shard = [&](int index) { return folder / ("shard-" + std::to_string(index)); };
  ASSERT_TRUE(eventually([&] { return !results(shard(1)).empty(); }, 120s)) << slurm.daemons();
  const std::size_t flown = results(shard(1)).size();
  EXPECT_LT(flown, 3u);
  EXPECT_EQ(slurm.ask("scontrol", {"requeue", job + "_1"}), "");
  // The second one is told what Slurm tells whose time is out, and queues itself again.
  ASSERT_TRUE(eventually([&] { return !results(shard(2)).empty(); }, 120s)) << slurm.daemons();
  EXPECT_EQ(slurm.ask("scancel", {"--batch", "--signal=INT", job + "_2"}), "");
  EXPECT_TRUE(eventually([&] { return slurm.ask("squeue", {"-h"}).empty(); }, 200s))
      << slurm.ask("squeue", {}) << slurm.daemons();
  EXPECT_EQ(results(shard(1)).size() + results(shard(2)).size(), 6u);
  const std::string log = words_of(folder / "task-1.log");
  EXPECT_THAT(log, HasSubstr("3 trials to fly, 0 done"));
  EXPECT_THAT(log, HasSubstr(std::to_string(3 - flown) + " trials to fly, " + std::to_string(flown) + " done"));
  const std::string other = words_of(folder / "task-2.log");
  EXPECT_THAT(other, HasSubstr("the same command goes on with them"));
  EXPECT_THAT(other, HasSubstr("out of time, queued again"));
  EXPECT_EQ(lines_of_trials(shard(2)), 1u + 3u) << other;
  EXPECT_EQ(lines_of_trials(shard(1)), 1u + 3u) << "a head, and each trial once\n" << log;

  Process merge((kPrograms / "gatefield-race").string(),
                {"merge", shard(1).string(), shard(2).string(), "--out", (folder / "all").string()},
                folder / "merge.log");
  ASSERT_EQ(merge.wait(60s).value_or(-1), 0) << merge.output();
  EXPECT_EQ(flights(folder / "all"), flights(folder / "whole"));
  EXPECT_EQ(flights(folder / "all").size(), 6u);
  EXPECT_TRUE(std::filesystem::exists(folder / "all/report/table.md"));
  std::filesystem::remove_all(folder);
}

TEST(CampaignOverSlurm, AnArrayThatIsNoSetOfShardsIsRefused) {
  const auto folder = fresh_folder("slurm-refused");
  const auto refused = [&](const std::vector<std::string>& environment, const std::vector<std::string>& arguments) {
    std::vector<std::string> words = environment;
    words.push_back((kDeploy / "slurm/campaign.sbatch").string());
    words.insert(words.end(), arguments.begin(), arguments.end());
    Process script("/usr/bin/env", words, folder / "script.log");
    EXPECT_EQ(script.wait(10s).value_or(-1), 2);
    return script.output();
  };
  EXPECT_THAT(refused({}, {"smoke", folder.string()}), HasSubstr("expected sbatch --array=1-N"));
  EXPECT_THAT(refused({"SLURM_ARRAY_TASK_ID=1"}, {"smoke"}), HasSubstr("expected sbatch --array=1-N"));
  EXPECT_THAT(refused({"SLURM_ARRAY_TASK_ID=3", "SLURM_ARRAY_TASK_MIN=2"}, {"smoke", folder.string()}),
              HasSubstr("--array begins with 2"));
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace gatefield::test
