// Bad input, as a user gives it to the programs: a clear sentence and the right exit code.

#include <gtest/gtest.h>

#include <csignal>
#include <fstream>
#include <thread>

#include "tests/integration/race/programs.h"
#include "tests/support/keys.h"

namespace gatefield::test {
namespace {

using namespace std::chrono_literals;

void expect_says(const Process& process, const std::string& text) {
  EXPECT_NE(process.output().find(text), std::string::npos) << "expected '" << text << "' in:\n" << process.output();
}

TEST(Refusal, AMissingModelNamesTheFile) {
  Programs programs("model");
  Process server((kPrograms / "gatefield-server").string(),
                 {"--domain", programs.domain(), "--model", "/nowhere/at-all"}, programs.file("log"));
  EXPECT_EQ(server.wait(5s).value_or(-1), 2) << server.output();
  expect_says(server, "/nowhere/at-all");
}

TEST(Refusal, ATruncatedModelNamesTheFile) {
  Programs programs("truncated");
  const auto folder = programs.file("model");
  std::filesystem::copy(kDeploy / "models/race", folder, std::filesystem::copy_options::recursive);
  std::filesystem::resize_file(folder / "decoder.onnx", std::filesystem::file_size(folder / "decoder.onnx") / 2);
  Process server((kPrograms / "gatefield-server").string(), {"--domain", programs.domain(), "--model", folder.string()},
                 programs.file("log"));
  EXPECT_EQ(server.wait(5s).value_or(-1), 2) << server.output();
  expect_says(server, "decoder.onnx");
}

TEST(Refusal, AMistakeInAProfileNamesFileAndLine) {
  Programs programs("profile");
  const auto folder = programs.file("profiles");
  std::filesystem::create_directories(folder);
  std::ofstream(folder / "mine.txt") << "name: \"mine\"\nsamples: many\n";
  Process server(
      (kPrograms / "gatefield-server").string(),
      {"--domain", programs.domain(), "--model", (kDeploy / "models/race").string(), "--profiles", folder.string()},
      programs.file("log"));
  EXPECT_EQ(server.wait(5s).value_or(-1), 2) << server.output();
  expect_says(server, "mine.txt:2");
}

TEST(Refusal, SecurityThatIsNotInOrderIsNoSecurity) {
  const Keys keys("refusal");
  Programs programs("security");
  const auto expect_refused = [&](Process program, const std::string& words) {
    EXPECT_EQ(program.wait(20s).value_or(-1), 2) << program.output();
    expect_says(program, words);
  };
  const auto server = [&](const std::string& folder, const std::string& name = "gatefield") {
    return programs.server("server.log", {"--security", folder, "--name", name});
  };
  expect_refused(server("/nowhere"), "\"/nowhere\", expected a folder of a server that gatefield-keys made");
  const std::string folder = keys.make("server", "gatefield");
  expect_refused(server(folder, "another"), "expected server \"another\"");
  expect_refused(server(keys.make("vehicle", "drone")), "expected server \"gatefield\"");
  std::filesystem::remove(folder + "/permissions.p7s");
  expect_refused(server(folder), "permissions.p7s");
  expect_refused(programs.simulator("sim.log", {"--scenario", "circle-0.3m", "--name", "rival", "--security",
                                                keys.make("vehicle", "drone")}),
                 "expected vehicle \"rival\"");
  expect_refused(
      programs.simulator("sim.log", {"--scenario", "circle-0.3m", "--security", keys.make("vehicle", "drone"),
                                     "--discovery-server", "127.0.0.1:11811"}),
      "none beside discovery servers");
}

TEST(Refusal, AnInterruptEndsTheSearchForAServer) {
  Programs programs("interrupt");
  Process sim = programs.simulator("sim.log", {"--scenario", "circle-0.3m", "--connect-timeout", "600"});
  std::this_thread::sleep_for(2s);
  ASSERT_TRUE(sim.running()) << sim.output();
  sim.signal(SIGINT);
  EXPECT_EQ(sim.wait(20s).value_or(-1), 0) << sim.output();
  expect_says(sim, "cancelled before a server answered");
}

TEST(Refusal, ASecondServerOfTheSameNameServesAndSaysSo) {
  Programs programs("second");
  Process first = programs.server("first.log", {"--name", "pit"});
  Process sim = programs.simulator("sim.log", {"--scenario", "circle-0.3m", "--realtime"});
  ASSERT_TRUE(sim.wait_for_output("lap 1 of 3 begins", 30s)) << sim.output() << first.output();
  Process second = programs.server("second.log", {"--name", "pit"});
  EXPECT_TRUE(second.wait_for_output("ready: server pit", 20s)) << second.output();
  EXPECT_TRUE(second.wait_for_output("another server of this name is in the domain", 10s)) << second.output();
  EXPECT_TRUE(first.wait_for_output("another server of this name is in the domain", 10s)) << first.output();
  EXPECT_TRUE(first.running());
  EXPECT_TRUE(sim.running()) << sim.output();
}

TEST(Refusal, AnUnknownProfileAndAnImpossibleVehicleAreRefusedByTheServer) {
  Programs programs("refused");
  Process server = programs.server("server.log");
  Process unknown = programs.simulator("sim1.log", {"--scenario", "circle-0.3m", "--profile", "warp"});
  EXPECT_NE(unknown.wait(20s).value_or(0), 0);
  expect_says(unknown, "warp");

  const auto vehicle = programs.file("heavy.txt");
  std::ifstream shipped(kDeploy / "config/vehicles/racer.txt");
  std::string text((std::istreambuf_iterator<char>(shipped)), {});
  const auto at = text.find("mass_kg:");
  ASSERT_NE(at, std::string::npos);
  text.replace(at, text.find('\n', at) - at, "mass_kg: 30");
  std::ofstream(vehicle) << text;
  Process heavy = programs.simulator("sim2.log", {"--scenario", "circle-0.3m", "--vehicle", vehicle.string()});
  EXPECT_EQ(heavy.wait(20s).value_or(0), 2) << heavy.output();
  expect_says(heavy, "thrust_max_n");
}

TEST(Refusal, ARateLoopFasterThanItsRotorsIsSaid) {
  Programs programs("rates");
  Process server = programs.server("server.log");
  const auto vehicle = programs.file("rates.txt");
  std::filesystem::copy(kDeploy / "config/vehicles/racer.txt", vehicle);
  std::ofstream(vehicle, std::ios::app) << "actuation { kind: BODY_RATES thrust_time_constant_s: 0.03\n"
                                           "            rate_time_constant_s { x: 0.015 y: 0.04 z: 0.1 } }\n";
  Process sim = programs.simulator("sim.log", {"--scenario", "circle-0.3m", "--vehicle", vehicle.string()});
  EXPECT_EQ(sim.wait(20s).value_or(0), 2) << sim.output();
  expect_says(sim, "rate_time_constant_s[0] is 0.015 s, expected at least 0.02 s");
}

TEST(Refusal, NoServerIsSaidWithinTheTimeOut) {
  Programs programs("noserver");
  Process sim = programs.simulator("sim.log", {"--scenario", "circle-0.3m", "--connect-timeout", "1"});
  EXPECT_EQ(sim.wait(10s).value_or(-1), 3) << sim.output();
}

}  // namespace
}  // namespace gatefield::test
