#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <optional>
#include <sstream>
#include <string>

#include "tests/integration/race/programs.h"

namespace gatefield {
namespace {

using namespace std::chrono_literals;

// The loops of docs/writing-a-client.md (client/sdk/examples/one_gate and rates) against the real server.
class OneGate : public ::testing::Test {
 protected:
  OneGate() : programs_("one-gate"), server_(programs_.server("server.log")) {}

  void SetUp() override { ASSERT_TRUE(server_.wait_for_output("ready: server", 60s)) << server_.output(); }

  struct Flight {
    std::optional<int> code;  // of the example: 0 passed
    std::string output;
  };
  Flight fly(int rate_hz, const std::string& timing, const std::string& program = ONE_GATE_EXAMPLE) {
    test::Process client(program, {programs_.domain(), std::to_string(rate_hz), timing}, programs_.file("client.log"));
    const auto code = client.wait(150s);
    return {code, client.output()};
  }
  void must_pass_in_lockstep(int rate_hz, const std::string& program = ONE_GATE_EXAMPLE) {
    const Flight flight = fly(rate_hz, "lockstep", program);
    EXPECT_EQ(flight.code, 0) << flight.output << server_.output();
  }
  // A machine that is busy lets the vehicle wait for its own loop: such a flight says nothing, and is flown again.
  void must_pass_in_real_time(int rate_hz) {
    for (int attempt = 0; attempt < 5; ++attempt) {
      const Flight flight = fly(rate_hz, "realtime");
      if (flight.code == 0) return;
      const auto said = flight.output.find("latest turn ");
      ASSERT_NE(said, std::string::npos) << flight.output << server_.output();
      ASSERT_GT(std::stoi(flight.output.substr(said + 12)), 20) << flight.output << server_.output();
    }
    FAIL() << "in five flights the loop was late by more than 20 ms each time: the machine is too busy for real time";
  }

  test::Programs programs_;
  test::Process server_;
};

TEST_F(OneGate, IsPassedInLockstepAtFiftyHertz) { must_pass_in_lockstep(50); }
TEST_F(OneGate, IsPassedInLockstepAtAHundredHertz) { must_pass_in_lockstep(100); }
TEST_F(OneGate, IsPassedInLockstepAtTwoHundredHertz) { must_pass_in_lockstep(200); }
TEST_F(OneGate, IsPassedInLockstepAtAThousandHertz) { must_pass_in_lockstep(1000); }

TEST_F(OneGate, IsPassedByBodyRatesAtFiftyHertz) { must_pass_in_lockstep(50, RATES_EXAMPLE); }
TEST_F(OneGate, IsPassedByBodyRatesAtTwoHundredHertz) { must_pass_in_lockstep(200, RATES_EXAMPLE); }

TEST_F(OneGate, IsPassedInRealTimeAtFiftyHertz) { must_pass_in_real_time(50); }
TEST_F(OneGate, IsPassedInRealTimeAtTwoHundredHertz) { must_pass_in_real_time(200); }
TEST_F(OneGate, IsPassedInRealTimeAtAThousandHertz) { must_pass_in_real_time(1000); }

std::string read(const std::filesystem::path& file) {
  std::ostringstream text;
  text << std::ifstream(std::filesystem::path(GATEFIELD_SOURCE_DIR) / file).rdbuf();
  return text.str();
}

TEST(Page, ShowsTheLoopsAsTheyAreBuiltAndFlown) {
  for (const std::string example : {"one_gate", "rates"}) {
    const std::string header = read("client/sdk/examples/" + example + "/fly.h");
    const std::string loop = header.substr(header.find("template"));
    EXPECT_NE(read("docs/writing-a-client.md").find(loop), std::string::npos)
        << "docs/writing-a-client.md has another loop than client/sdk/examples/" << example << "/fly.h:\n"
        << loop;
  }
}

}  // namespace
}  // namespace gatefield
