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

TEST(Summary, ShowsWhatTheServerToldRightAfterTheResult) {
  Report report;
  report.sentence = "got stuck before gate 1";
  EXPECT_THAT(summarize(report), Not(HasSubstr("Problem")));
  report.problems = {"no gate seen where one should be", "plans are withheld"};
  EXPECT_THAT(summarize(report), HasSubstr("Result        got stuck before gate 1\n"
                                           "Problem       no gate seen where one should be\n"
                                           "Problem       plans are withheld\n"));
}

}  // namespace
}  // namespace gatefield::simulator
