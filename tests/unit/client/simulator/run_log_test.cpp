#include "client/simulator/run_log.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace gatefield::simulator {
namespace {

using testing::HasSubstr;
using testing::Not;

TEST(Summary, SaysBothSeeds) {
  Report report;
  report.seed = 1001;
  report.planner_seed = 7;
  EXPECT_THAT(summarize(report), HasSubstr("Seeds         world 1001, planner 7\n"));
}

TEST(Summary, SaysHowTheVehicleWasDrivenAndWhatOfItWasNotAsTold) {
  Report report;
  EXPECT_THAT(summarize(report), HasSubstr("Driven by     rotor thrusts\n"));
  report.actuation.kind = Actuation::Kind::kBodyRates;
  EXPECT_THAT(summarize(report), HasSubstr("Driven by     body rates\n"));
  report.mismatch.rate_lag_factor = 0.67;
  report.mismatch.setpoint_delay = std::chrono::milliseconds(20);
  report.mismatch.rate_limit_rad_s = {2, 2.5, 1.5};
  report.mismatch.thrust_factor = 1.1;
  EXPECT_THAT(summarize(report),
              HasSubstr("Driven by     body rates; rate loop x 0.67; rates at most 2, 2.5, 1.5 rad/s; setpoints 20 ms "
                        "late; thrust x 1.1\n"));
}

TEST(Summary, ShowsWhatTheServerToldRightAfterTheResult) {
  Report report;
  report.sentence = "got stuck before gate 1";
  EXPECT_THAT(summarize(report), Not(HasSubstr("Problem")));
  report.problems = {{0.625, protocol::Problem::kVelocityAgainstMotion}, {12.5, protocol::Problem::kDelayLong}};
  EXPECT_THAT(
      summarize(report),
      HasSubstr("Result        got stuck before gate 1\n"
                "Problem       at 0.62 s: the velocity sent is not the change of the position sent: check frame and "
                "unit of v_WB\n"
                "Problem       at 12.50 s: the delay is longer than the 0.4 s that the planner makes up for\n"));
}

}  // namespace
}  // namespace gatefield::simulator
