// A server that goes in mid-race, with a stand-by there: the race goes on.

#include <gtest/gtest.h>

#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <iostream>
#include <map>
#include <memory>
#include <mutex>
#include <regex>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "common/base/clock.h"
#include "common/base/statistics.h"
#include "common/dds/convert.h"
#include "common/dds/participant.h"
#include "common/dds/qos.h"
#include "common/dds/reader.h"
#include "gatefield_idl/gatefieldPubSubTypes.h"
#include "tests/integration/race/programs.h"
#include "tests/support/keys.h"

namespace gatefield::test {
namespace {

using namespace std::chrono_literals;

/// Hears every command in the domain.
class Listener {
 public:
  Listener() {
    auto participant = dds::Participant::open(own_domain(), "listener", {}, {}, [](const dds::PeerEvent&) {});
    if (!participant) throw std::runtime_error(participant.error());
    participant_ = std::move(participant).value();
    Commands::Callbacks callbacks;
    callbacks.sample = [this](wire::ThrustRateCommand* command, const dds::Origin& origin) {
      const std::lock_guard lock(mutex_);
      if (command->session() == 0) return;
      heard_.push_back({clock_.now(), origin.participant});
    };
    callbacks.unreadable = [] {};
    auto commands =
        Commands::open(participant_.get(), dds::Topic::kCommand, std::move(callbacks), dds::command_partition("*"));
    if (!commands) throw std::runtime_error(commands.error());
    commands_ = std::move(commands).value();
  }
  /// Longest time between two commands around a change of who sends them, s; 0: nobody changed.
  double gap_at_change_s() const {
    const std::lock_guard lock(mutex_);
    double gap_s = 0.0;
    for (std::size_t i = 1; i < heard_.size(); ++i)
      if (heard_[i].from != heard_[i - 1].from) gap_s = std::max(gap_s, seconds(heard_[i].came - heard_[i - 1].came));
    return gap_s;
  }

 private:
  using Commands = dds::Reader<wire::ThrustRateCommandPubSubType>;
  struct Heard {
    Stamp came{0};
    dds::ParticipantId from;
  };
  const MonotonicClock clock_;
  mutable std::mutex mutex_;
  std::vector<Heard> heard_;
  std::unique_ptr<dds::Participant> participant_;
  std::unique_ptr<Commands> commands_;
};

/// A leader, its stand-by, and a race that has begun.
class Standby : public ::testing::Test {
 protected:
  void begin(int seed, int laps = 2) {
    programs_ = std::make_unique<Programs>("standby");
    if (!keys_) listener_ = std::make_unique<Listener>();  // in a closed domain nobody else hears commands
    leader_ = start("leader.log", kLeader);
    heir_ = start("heir.log", kHeir);
    ASSERT_TRUE(leader_->wait_for_output("the stand-by is there", 60s)) << logs();
    ASSERT_TRUE(heir_->wait_for_output("the leader is there", 60s)) << logs();
    std::vector<std::string> arguments{"--scenario", "circle-0.3m", "--seed", std::to_string(seed),
                                       "--speed",    "7",           "--laps", std::to_string(laps),
                                       "--realtime", "--name",      kRacer};
    if (keys_) arguments.insert(arguments.end(), {"--security", keys_->make("vehicle", kRacer)});
    sim_ = std::make_unique<Process>(programs_->simulator("sim.log", arguments));
    ASSERT_TRUE(sim_->wait_for_output("lap 1 of ", 60s)) << logs();
    ASSERT_TRUE(heir_->wait_for_output("stands by for session", 20s)) << logs();
    std::this_thread::sleep_for(std::chrono::milliseconds(1000 + 137 * (seed % 10)));
  }
  /// Won, by the stand-by, without joining anew.
  void expect_won() {
    const auto code = sim_->wait(120s);
    EXPECT_EQ(code.value_or(-1), 0) << logs();
    EXPECT_TRUE(heir_->wait_for_output("takes over session", 1s)) << logs();
    EXPECT_EQ(sim_->output().find("Reconnected"), std::string::npos) << logs();
    EXPECT_NE(sim_->output().find("the session goes on with server"), std::string::npos) << logs();
  }
  /// What became of several flights.
  struct Tally {
    int flown = 0, won = 0, without_fallback = 0;
    std::vector<double> gaps_s;
    void tell() const {
      std::cout << won << " of " << flown << " won, " << without_fallback << " without fallback; gap in commands p50 "
                << 1e3 * quantile(gaps_s, 0.5) << " ms, p99 " << 1e3 * quantile(gaps_s, 0.99) << " ms, most "
                << 1e3 * *std::max_element(gaps_s.begin(), gaps_s.end()) << " ms\n";
    }
  };
  void end(int seed, Tally* tally) {
    ++tally->flown;
    tally->won += sim_->wait(0s).value_or(-1) == 0 ? 1 : 0;
    tally->without_fallback += fallback_s() == 0.0 ? 1 : 0;
    tally->gaps_s.push_back(listener_->gap_at_change_s());
    std::cout << "seed " << seed << ": gap " << 1e3 * tally->gaps_s.back() << " ms, " << fallback_s()
              << " s without a plan\n";
    sim_.reset(), leader_.reset(), heir_.reset(), listener_.reset();
  }
  double fallback_s() const {
    const std::string output = sim_->output();
    std::smatch found;
    if (!std::regex_search(output, found, std::regex("; ([0-9.]+) s without a valid plan"))) return -1.0;
    return std::stod(found[1]);
  }
  std::string logs() const {
    std::string all = "---- leader\n" + leader_->output() + "---- stand-by\n" + heir_->output();
    return sim_ ? all + "---- simulator\n" + sim_->output() : all;
  }
  std::unique_ptr<Process> start(const std::string& log, std::vector<std::string> arguments) {
    if (keys_) arguments.insert(arguments.end(), {"--security", keys_->make("server", arguments.at(1))});
    return std::make_unique<Process>(programs_->server(log, arguments));
  }

  static constexpr const char* kRacer = "racer";
  const std::vector<std::string> kLeader{"--name", "a", "--standby", "b", "--standby-of", "b"};
  const std::vector<std::string> kHeir{"--name", "b", "--standby", "a", "--standby-of", "a"};
  std::unique_ptr<Keys> keys_;  // of a closed domain
  std::unique_ptr<Programs> programs_;
  std::unique_ptr<Listener> listener_;
  std::unique_ptr<Process> leader_, heir_, sim_;
};

constexpr double kControlPeriod_s = 0.02;  // of the profile race
/// Without a plan, where other programs take the processor; by itself it is none at all.
constexpr double kBusyMachine_s = 1.0;

int times(const char* variable) {
  const char* const text = std::getenv(variable);
  return text == nullptr ? 1 : std::max(1, std::atoi(text));
}

/// GATEFIELD_TAKEOVERS=50 is the long check.
TEST_F(Standby, ALeaderThatIsKilledCostsNoRace) {
  const int flights = times("GATEFIELD_TAKEOVERS");
  Tally tally;
  for (int seed = 1; seed <= flights; ++seed) {
    begin(seed);
    if (HasFatalFailure()) return;
    leader_->signal(SIGKILL);
    expect_won();
    EXPECT_LE(fallback_s(), kBusyMachine_s) << logs();
    end(seed, &tally);
  }
  tally.tell();
  if (flights == 1) return;  // on a busy machine that says nothing
  EXPECT_EQ(tally.without_fallback, flights);
  EXPECT_LE(quantile(tally.gaps_s, 0.99), 0.12);
}

TEST_F(Standby, ALeaderThatIsHeldUpLetsGoWhenItIsBack) {
  begin(2);
  leader_->signal(SIGSTOP);
  ASSERT_TRUE(heir_->wait_for_output("takes over session", 20s)) << logs();
  std::this_thread::sleep_for(500ms);
  leader_->signal(SIGCONT);
  EXPECT_TRUE(leader_->wait_for_output(" ended, ", 20s)) << logs();
  expect_won();
  EXPECT_LE(fallback_s(), kBusyMachine_s) << logs();
}

/// GATEFIELD_DRAINS=20 is the long check: no tick is missed.
TEST_F(Standby, ALeaderThatIsDrainedHandsOverAndEnds) {
  const int flights = times("GATEFIELD_DRAINS");
  Tally tally;
  for (int seed = 3; seed < 3 + flights; ++seed) {
    begin(seed);
    if (HasFatalFailure()) return;
    leader_->signal(SIGUSR1);
    EXPECT_EQ(leader_->wait(20s).value_or(-1), 0) << logs();
    expect_won();
    // Where the machine was too busy for 60 ms, the stand-by had taken it before.
    if (flights > 1 || leader_->output().find("its stand-by flies it") == std::string::npos) {
      EXPECT_NE(leader_->output().find("handed over"), std::string::npos) << logs();
      EXPECT_NE(heir_->output().find("its leader handed it over"), std::string::npos) << logs();
    }
    EXPECT_LE(fallback_s(), kBusyMachine_s) << logs();
    end(seed, &tally);
  }
  tally.tell();
  if (flights == 1) return;
  EXPECT_EQ(tally.without_fallback, flights);
  EXPECT_LT(*std::max_element(tally.gaps_s.begin(), tally.gaps_s.end()), 2.0 * kControlPeriod_s) << "no tick is missed";
}

TEST_F(Standby, InAClosedDomainToo) {
  keys_ = std::make_unique<Keys>("standby");
  begin(5);
  leader_->signal(SIGKILL);
  expect_won();
  EXPECT_LE(fallback_s(), kBusyMachine_s) << logs();
}

TEST_F(Standby, TwoThatStandByForEachOtherGoOneAfterTheOther) {
  begin(4, 4);
  leader_->signal(SIGKILL);
  ASSERT_TRUE(heir_->wait_for_output("takes over session", 20s)) << logs();
  auto again = start("again.log", kLeader);
  ASSERT_TRUE(again->wait_for_output("stands by for session", 20s)) << logs() << again->output();
  heir_->signal(SIGKILL);
  const auto code = sim_->wait(120s);
  EXPECT_EQ(code.value_or(-1), 0) << logs() << again->output();
  EXPECT_TRUE(again->wait_for_output("takes over session", 1s)) << logs() << again->output();
  EXPECT_EQ(sim_->output().find("Reconnected"), std::string::npos) << logs();
  EXPECT_LE(fallback_s(), kBusyMachine_s) << logs();
}

}  // namespace
}  // namespace gatefield::test
