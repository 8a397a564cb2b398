// Races of three laps in lockstep: server and simulators as processes, on depth alone.

#include <gtest/gtest.h>

#include <csignal>
#include <fstream>
#include <map>
#include <sstream>

#include "tests/integration/race/programs.h"
#include "tests/support/keys.h"

namespace gatefield::test {
namespace {

using namespace std::chrono_literals;

/// A run's CSV without the measured times, which differ from run to run.
std::string flown_path(const std::filesystem::path& file) {
  std::ifstream in(file);
  std::string line, path;
  std::getline(in, line);
  std::vector<bool> keep;
  std::istringstream header(line);
  for (std::string name; std::getline(header, name, ',');)
    keep.push_back(name == "t_s" || name.starts_with('p') || name.starts_with('v') || name.starts_with('q'));
  while (std::getline(in, line)) {
    std::istringstream row(line);
    std::size_t column = 0;
    for (std::string value; std::getline(row, value, ','); ++column)
      if (column < keep.size() && keep[column]) path += value + ',';
    path += '\n';
  }
  return path;
}

TEST(Race, ThreeLapsOnSeveralSeedsAndTheSameSeedFliesTheSame) {
  Programs programs("race");
  Process server = programs.server("server.log");
  const auto fly = [&](const std::string& seed, const std::string& csv) {
    Process sim = programs.simulator("sim-" + csv + ".log", {"--scenario", "circle-0.3m", "--seed", seed, "--speed",
                                                             "7", "--lockstep", "--csv", programs.file(csv).string()});
    const auto code = sim.wait(120s);
    EXPECT_TRUE(code.has_value()) << "seed " << seed << " takes too long";
    return std::pair(code.value_or(-1), sim.output());
  };
  for (const std::string seed : {"1", "2", "3"}) {
    const auto [code, output] = fly(seed, "run" + seed + ".csv");
    EXPECT_EQ(code, 0) << "seed " << seed << "\n" << output << server.output();
  }
  const auto [code, output] = fly("2", "again.csv");
  EXPECT_EQ(code, 0) << output;
  const std::string first = flown_path(programs.file("run2.csv"));
  EXPECT_GT(first.size(), 10000u);
  EXPECT_EQ(first, flown_path(programs.file("again.csv")));
  EXPECT_NE(first, flown_path(programs.file("run1.csv")));

  server.signal(SIGTERM);
  EXPECT_EQ(server.wait(2s).value_or(-1), 0) << server.output();
}

TEST(Race, AClosedDomainFliesTheSame) {
  const Keys keys("race");
  Programs programs("closed");
  const auto fly = [&](const std::string& name, const std::vector<std::string>& of_server,
                       const std::vector<std::string>& of_vehicle) {
    Process server = programs.server(name + "-server.log", of_server);
    std::vector<std::string> words{"--scenario",
                                   "circle-0.3m",
                                   "--seed",
                                   "2",
                                   "--laps",
                                   "1",
                                   "--speed",
                                   "7",
                                   "--lockstep",
                                   "--csv",
                                   programs.file(name + ".csv").string()};
    words.insert(words.end(), of_vehicle.begin(), of_vehicle.end());
    Process sim = programs.simulator(name + "-sim.log", words);
    EXPECT_EQ(sim.wait(120s).value_or(-1), 0) << sim.output() << server.output();
    EXPECT_EQ(server.output().find("warning"), std::string::npos) << server.output();
    server.signal(SIGTERM);
    EXPECT_EQ(server.wait(5s).value_or(-1), 0) << server.output();
    return flown_path(programs.file(name + ".csv"));
  };
  const std::string open = fly("open", {}, {});
  const std::string closed =
      fly("closed", {"--security", keys.make("server", "gatefield")}, {"--security", keys.make("vehicle", "drone")});
  EXPECT_GT(open.size(), 3000u);
  EXPECT_EQ(open, closed);
}

TEST(Race, ThreeVehiclesAtOnce) {
  Programs programs("three");
  Process server = programs.server("server.log");
  std::vector<std::unique_ptr<Process>> sims;
  for (const std::string seed : {"1", "2", "3"})
    sims.push_back(std::make_unique<Process>(
        (kPrograms / "gatefield-sim").string(),
        std::vector<std::string>{"--domain", programs.domain(), "--name", "drone" + seed, "--scenario", "circle-0.3m",
                                 "--seed", seed, "--speed", "7", "--lockstep"},
        programs.file("sim" + seed + ".log")));
  for (auto& sim : sims) {
    const auto code = sim->wait(180s);
    EXPECT_EQ(code.value_or(-1), 0) << sim->output() << server.output();
  }
}

}  // namespace
}  // namespace gatefield::test
