// gatefield-race tune with the real server: a search of one generation through one gate.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "client/race/trial_log.h"
#include "tests/integration/race/programs.h"

namespace gatefield::test {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

class TuneTest : public testing::Test {
 protected:
  TuneTest() : folder_(fresh_folder("tune")) {}
  ~TuneTest() override { std::filesystem::remove_all(folder_); }

  /// What the program says. @param code  that it ends with
  std::string run(const std::string& program, const std::vector<std::string>& arguments, int code = 0) const {
    Process process((kPrograms / program).string(), arguments, folder_ / "log");
    EXPECT_EQ(process.wait(150s).value_or(-1), code) << process.output();
    return process.output();
  }
  std::string put(const std::string& text) const {
    std::ofstream(folder_ / "tune.txt") << text;
    return (folder_ / "tune.txt").string();
  }
  std::string text(const std::string& name) const {
    std::stringstream out;
    out << std::ifstream(folder_ / name).rdbuf();
    return out.str();
  }
  std::string out() const { return (folder_ / "out").string(); }

  std::filesystem::path folder_;
};

TEST_F(TuneTest, AGenerationIsFlownComparedAndTakenByTheServer) {
  const std::string said = run("gatefield-race", {"tune", "smoke", "--out", out(), "--workers", "2"});
  EXPECT_THAT(said, HasSubstr("The found profile is NOT shown to be better")) << "two races show nothing";
  const auto generation = race::read_trials(folder_ / "out/generations/001");
  ASSERT_TRUE(generation.ok()) << generation.error();
  ASSERT_EQ(generation->size(), 6u);
  EXPECT_TRUE(generation->front().won()) << generation->front().sentence;
  std::set<std::uint64_t> flights;
  for (const race::TrialResult& result : *generation) flights.insert(result.flight);
  EXPECT_EQ(flights.size(), 6u) << "each profile flies another way";
  EXPECT_EQ(race::read_trials(folder_ / "out/comparison-001")->size(), 2u);

  const std::string profiles = (folder_ / "out/profiles").string();
  const std::string found = run("gatefield-server", {"--profiles", profiles, "--show-profile", "race-tuned"});
  EXPECT_THAT(found, HasSubstr("name: \"race-tuned\""));
  EXPECT_NE(found.substr(found.find('\n')), run("gatefield-server", {"--profiles", profiles, "--show-profile", "race"})
                                                .substr(std::string("name: \"race\"").size()));

  const std::string trace = text("out/trace.csv");
  const std::string again = run("gatefield-race", {"tune", "smoke", "--out", out(), "--workers", "2"});
  EXPECT_THAT(again, HasSubstr("The found profile is"));
  EXPECT_EQ(text("out/trace.csv"), trace) << "nothing was left to fly";
}

TEST_F(TuneTest, TheUsualFieldsAreThoseOfTheProfilesThatShip) {
  const std::string races =
      "races { cell { name: 'a' course: 'circle' vehicle: 'racer%' speed_m_s: 6 seeds { first: 1 last: 9 } } } trials: "
      "900";
  const auto fields = [&](const std::string& vehicle) {
    std::string spec = races;
    return run("gatefield-race", {"tune", put(spec.replace(spec.find('%'), 1, vehicle)), "--out", out(), "--dry-run"});
  };
  EXPECT_THAT(fields(""),
              testing::AllOf(HasSubstr(": 11 fields of profile race, 11 candidates"),
                             HasSubstr("\nrotors_yaw_sigma_rad_s3: 115.2, from 28.8 to 460.8, logarithmic\n")));
  EXPECT_THAT(fields("-rates"), testing::AllOf(HasSubstr(": 12 fields of profile race"),
                                               HasSubstr("\nrates_correlation: 0.85, from 0.5 to 0.97, linear\n")));
  EXPECT_FALSE(std::filesystem::exists(out()));
}

TEST_F(TuneTest, BadInputIsSaidBeforeAnythingStarts) {
  const auto refused = [this](const std::string& spec, const std::vector<std::string>& more = {}) {
    std::vector<std::string> arguments{"tune", put(spec), "--out", out()};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run("gatefield-race", arguments, 2);
  };
  const std::string races = "races { cell { name: 'a' scenario: 'circle' speed_m_s: 6 seeds { first: 1 last: 9 } } }\n";
  EXPECT_THAT(
      refused(races + "profile: 'warp' trials: 900"),
      HasSubstr("the profile 'warp' is not to be had: gatefield-server: --show-profile is 'warp', expected one of"));
  EXPECT_THAT(refused(races + "field { name: 'warp' } trials: 900"), HasSubstr("tune.txt: field 'warp': is no number"));
  EXPECT_THAT(refused(races + "fresh_seeds { first: 1001 last: 1002 } trials: 900"), HasSubstr("seeds of the lab"));
  EXPECT_THAT(refused(races, {"--trials", "20"}), HasSubstr("trials is 20, expected at least"));
  EXPECT_FALSE(std::filesystem::exists(out()));
}

}  // namespace
}  // namespace gatefield::test
