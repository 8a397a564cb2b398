#include <gtest/gtest.h>

#include <memory>

#include "tests/integration/faults/faulty_flight.h"
#include "tests/integration/race/programs.h"

namespace gatefield::test {
namespace {

using namespace std::chrono_literals;
using protocol::Problem;
using simulator::Outcome;

/// One server for all flights.
class Faults : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    programs_ = std::make_unique<Programs>("faults");
    server_ = std::make_unique<Process>(programs_->server("server.log"));
    ASSERT_TRUE(server_->wait_for_output("ready: server", 60s)) << server_->output();
  }
  static void TearDownTestSuite() {
    server_.reset();
    programs_.reset();
  }

 private:
  static std::unique_ptr<Programs> programs_;
  static std::unique_ptr<Process> server_;
};
std::unique_ptr<Programs> Faults::programs_;
std::unique_ptr<Process> Faults::server_;

TEST_F(Faults, ARaceWithoutAnyHearsOfNone) {
  const Flown flown = fly_with({});
  EXPECT_EQ(flown.report.outcome, Outcome::kFinished) << flown.story();
  EXPECT_TRUE(flown.heard_s.empty()) << flown.story();
}

}  // namespace
}  // namespace gatefield::test
