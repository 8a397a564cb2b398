// The course, the vehicle and the scenario of docs/courses-and-vehicles.md, flown by the real programs.
#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <string>
#include <vector>

#include "tests/examples/page.h"
#include "tests/integration/race/programs.h"

namespace gatefield::test {
namespace {

using std::chrono::seconds;

void expect_won(const std::vector<std::string>& what) {
  const Programs programs("examples");
  write_files(shown_files(std::filesystem::path(GATEFIELD_SOURCE_DIR) / "docs/courses-and-vehicles.md"),
              programs.file("."));
  std::vector<std::string> arguments = {"--lockstep", "--speed", "5"};
  for (const std::string& word : what)
    arguments.push_back(word.starts_with("my/") ? programs.file(word).string() : word);
  Process server = programs.server("server.log");
  Process simulator = programs.simulator("sim.log", arguments);
  EXPECT_EQ(simulator.wait(seconds(200)), 0) << simulator.output();
  server.signal(SIGTERM);
  EXPECT_EQ(server.wait(seconds(20)), 0) << server.output();
}

TEST(Examples, TheCourseIsWonByTheVehicle) { expect_won({"--course", "my/hall.txt", "--vehicle", "my/heavy.txt"}); }

TEST(Examples, TheScenarioIsWon) { expect_won({"--scenario", "my/windy.txt"}); }

}  // namespace
}  // namespace gatefield::test
