// The whole recipe in small: from rendering to bundles that the server loads and that know more than a constant.

#include <gtest/gtest.h>

#include <csignal>
#include <fstream>
#include <map>
#include <string>

#include "tests/integration/race/programs.h"

namespace gatefield::test {
namespace {

using namespace std::chrono_literals;

/// Figures of an evaluation.csv that belong to all frames of a table, by column.
std::map<std::string, double> figures(const std::filesystem::path& file, const std::string& table) {
  std::map<std::string, double> out;
  std::ifstream in(file);
  const std::string row = "\"together, all\",";
  for (std::string line; std::getline(in, line);) {
    const auto at = line.find(row);
    if (line.find(table) == std::string::npos || at == std::string::npos) continue;
    const auto comma = line.rfind(',');
    std::string column = line.substr(at + row.size(), comma - at - row.size());
    std::erase(column, '"');
    out[column] = std::strtod(line.c_str() + comma + 1, nullptr);
  }
  return out;
}

TEST(Recipe, MakesABundleThatBeatsTheConstantAndThatTheServerLoads) {
  Programs programs("recipe");
  const auto models = programs.file("models");
  const std::vector<std::string> arguments = {
      "all",   "--profile",     "try",    "--work", programs.file("work").string(),
      "--out", models.string(), "--only", "race",   "race-stereo"};
  Process train((kPrograms / "gatefield-train").string(), arguments, programs.file("train.log"));
  ASSERT_EQ(train.wait(330s).value_or(-1), 0) << train.output();

  const auto found = figures(models / "race/evaluation/evaluation.csv", "Errors, simulation, with a prior");
  ASSERT_TRUE(found.contains("box, m") && found.contains("box, m (const.)")) << train.output();
  EXPECT_GT(found.at("n"), 100.0);
  // 9600 image passes take the box error to about 0.13 m; the constant stands at 0.21 m.
  EXPECT_LT(found.at("box, m"), 0.8 * found.at("box, m (const.)"));
  EXPECT_GT(found.at("sign, %"), found.at("sign, % (const.)") + 10.0);

  Process server((kPrograms / "gatefield-server").string(),
                 {"--domain", programs.domain(), "--model", (models / "race").string(), "--profiles",
                  (kDeploy / "config/profiles").string()},
                 programs.file("server.log"));
  EXPECT_TRUE(server.wait_for_output("ready", 20s)) << server.output();
  server.signal(SIGTERM);
  EXPECT_EQ(server.wait(10s).value_or(-1), 0) << server.output();

  // The second stage keeps the field's decoder.
  EXPECT_TRUE(std::filesystem::exists(models / "race-stereo/evaluation/evaluation.csv"));
  const auto bytes = [&](const char* name) {
    std::ifstream in(models / name / "decoder.onnx", std::ios::binary);
    return std::string(std::istreambuf_iterator<char>(in), {});
  };
  EXPECT_FALSE(bytes("race").empty());
  EXPECT_EQ(bytes("race"), bytes("race-stereo"));

  // The same command again finds everything done.
  Process again((kPrograms / "gatefield-train").string(), arguments, programs.file("again.log"));
  ASSERT_EQ(again.wait(30s).value_or(-1), 0) << again.output();
  EXPECT_NE(again.output().find("steps are done"), std::string::npos) << again.output();
}

}  // namespace
}  // namespace gatefield::test
