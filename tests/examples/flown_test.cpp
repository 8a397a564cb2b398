// What docs/courses-and-vehicles.md and docs/adding-a-sensor.md show, flown by the real programs.
#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <sstream>
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

/// The command lines of a page's first block without a name: the words of each, but for a last "&".
std::vector<std::vector<std::string>> shown_commands(const std::filesystem::path& page) {
  const std::string fence = "```\n";
  const std::string text = text_of(page);
  const std::size_t begin = text.find(fence) + fence.size();
  std::istringstream block(text.substr(begin, text.find(fence, begin) - begin));
  std::vector<std::vector<std::string>> commands;
  for (std::string line; std::getline(block, line);) {
    std::vector<std::string>& words = commands.emplace_back();
    std::istringstream of(line);
    for (std::string word; of >> word;)
      if (word != "&") words.push_back(word);
  }
  return commands;
}

/// Runs it as shown, but for the domain and the place of the picture.
Process run(const std::vector<std::string>& words, const Programs& programs, const std::string& log) {
  std::vector<std::string> arguments;
  for (std::size_t i = 1; i < words.size(); ++i)
    arguments.push_back(words[i - 1] == "--domain"    ? programs.domain()
                        : words[i - 1] == "--picture" ? programs.file(words[i]).string()
                                                      : words[i]);
  return Process((kPrograms / std::filesystem::path(words.at(0)).filename()).string(), arguments, programs.file(log));
}

TEST(Examples, TheClassicalSensorWinsByThePagesCommands) {
  const Programs programs("sensor-page");
  const auto commands = shown_commands(std::filesystem::path(GATEFIELD_SOURCE_DIR) / "docs/adding-a-sensor.md");
  ASSERT_EQ(commands.size(), 2u);
  Process server = run(commands[0], programs, "server.log");
  Process simulator = run(commands[1], programs, "sim.log");
  EXPECT_EQ(simulator.wait(seconds(200)), 0) << simulator.output() << server.output();
  server.signal(SIGTERM);
  EXPECT_EQ(server.wait(seconds(20)), 0) << server.output();
}

}  // namespace
}  // namespace gatefield::test
