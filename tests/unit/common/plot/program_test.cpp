#include "common/plot/program.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace gatefield::plot {
namespace {

using namespace std::chrono_literals;

TEST(RunProgram, GivesExitCodeAndWords) {
  const ProgramEnd end = run_program({"sh", "-c", "pwd >&2; exit 3"}, "/", 5s);
  EXPECT_EQ(end.kind, ProgramEnd::Kind::kExited);
  EXPECT_EQ(end.code, 3);
  EXPECT_EQ(end.words, "/");
}

TEST(RunProgram, ArgumentsAreNoShellWords) {
  const ProgramEnd end = run_program({"sh", "-c", "printf %s \"$1\" >&2", "sh", "$(echo no); `x` 'y'"}, "", 5s);
  EXPECT_EQ(end.words, "$(echo no); `x` 'y'");
}

TEST(RunProgram, StopsWhatTakesTooLong) {
  const auto begun = std::chrono::steady_clock::now();
  const ProgramEnd end = run_program({"sleep", "30"}, "", 100ms);
  EXPECT_EQ(end.kind, ProgramEnd::Kind::kTooLong);
  EXPECT_LT(std::chrono::steady_clock::now() - begun, 10s);
}

TEST(RunProgram, ManyWordsDoNotHoldItUp) {
  const ProgramEnd end = run_program({"sh", "-c", "head -c 300000 /dev/zero | tr '\\0' x >&2"}, "", 10s);
  EXPECT_EQ(end.kind, ProgramEnd::Kind::kExited);
  EXPECT_EQ(end.words.size(), 2000u);
}

TEST(RunProgram, TellsAMissingProgramFromAMissingFolder) {
  EXPECT_EQ(run_program({"no-such-program-anywhere"}, "", 5s).kind, ProgramEnd::Kind::kNotFound);
  EXPECT_EQ(run_program({"true"}, "/no/such/folder", 5s).kind, ProgramEnd::Kind::kFailed);
}

}  // namespace
}  // namespace gatefield::plot
