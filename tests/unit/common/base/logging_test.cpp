#include "common/base/logging.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace gatefield::log {
namespace {

using ::testing::HasSubstr;
using ::testing::MatchesRegex;

std::string said(Format format, std::string_view message) {
  ::testing::internal::CaptureStderr();
  start("logging_test", "info", format);
  warn(message);
  return ::testing::internal::GetCapturedStderr();
}

TEST(Logging, LinesForMachinesAreJson) {
  EXPECT_THAT(
      said(Format::kJson, "hello"),
      MatchesRegex(R"(\{"time":"[0-9-]+T[0-9:]+\.[0-9]+Z","level":"warning","program":"logging_test","message":"hello"\}
)"));
}

TEST(Logging, NoMessageBreaksItsLine) {
  EXPECT_THAT(said(Format::kJson, "a \"b\" \\ c\nd\x1b[0m \xc3\xa4"),
              HasSubstr("\"message\":\"a \\\"b\\\" \\\\ c\\u000ad\\u001b[0m \xc3\xa4\"}\n"));
}

TEST(Logging, LinesForPeopleAreAsTheyWere) {
  EXPECT_THAT(said(Format::kText, "hello"), HasSubstr("logging_test warning hello\n"));
}

}  // namespace
}  // namespace gatefield::log
