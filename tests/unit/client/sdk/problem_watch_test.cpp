#include "client/sdk/problem_watch.h"

#include <gtest/gtest.h>

#include <vector>

#include "tests/support/allocation_trap.h"

namespace gatefield::sdk {
namespace {

using protocol::Problem;

constexpr protocol::Problems kNed = bit(Problem::kStatesLookNed);
constexpr protocol::Problems kDepth = bit(Problem::kDepthMissing);

/// All changes that wait: "+" and the problem's number for what began, "-" for what ended.
std::vector<int> changes(ProblemWatch* watch) {
  std::vector<int> all;
  while (const auto change = watch->next()) all.push_back((change->began ? 1 : -1) * static_cast<int>(change->problem));
  return all;
}

constexpr int kNedNumber = static_cast<int>(Problem::kStatesLookNed);
constexpr int kDepthNumber = static_cast<int>(Problem::kDepthMissing);

TEST(ProblemWatch, KnowsNothingWrongAtFirst) {
  ProblemWatch watch;
  EXPECT_EQ(watch.now(), 0u);
  EXPECT_FALSE(watch.next().has_value());
}

TEST(ProblemWatch, TellsEachChangeOnceInTheOrderOfHearing) {
  ProblemWatch watch;
  watch.on_command(kNed);
  watch.on_command(kNed);
  EXPECT_EQ(watch.now(), kNed);
  watch.on_command(kNed | kDepth);
  watch.on_command(kDepth);
  EXPECT_EQ(changes(&watch), (std::vector{kNedNumber, kDepthNumber, -kNedNumber}));
  EXPECT_FALSE(watch.next().has_value());
  watch.on_command(0);
  EXPECT_EQ(changes(&watch), std::vector{-kDepthNumber});
}

TEST(ProblemWatch, AProblemIsThereWhileCommandOrTelemetrySaysSo) {
  ProblemWatch watch;
  watch.on_command(kNed);
  watch.on_telemetry(kNed | kDepth);
  EXPECT_EQ(watch.now(), kNed | kDepth);
  watch.on_command(0);
  EXPECT_EQ(watch.now(), kNed | kDepth) << "telemetry still says so";
  EXPECT_EQ(changes(&watch), (std::vector{kNedNumber, kDepthNumber}));
  watch.on_telemetry(0);
  EXPECT_EQ(watch.now(), 0u);
  EXPECT_EQ(changes(&watch), (std::vector{-kNedNumber, -kDepthNumber}));
}

TEST(ProblemWatch, ANewSessionBeginsWithNothingWrong) {
  ProblemWatch watch;
  watch.on_command(kNed);
  watch.on_telemetry(kDepth);
  changes(&watch);
  watch.reset();
  EXPECT_EQ(watch.now(), 0u);
  EXPECT_EQ(changes(&watch), (std::vector{-kNedNumber, -kDepthNumber}));
}

TEST(ProblemWatch, OfTooManyChangesTheNewestWait) {
  ProblemWatch watch;
  for (int i = 0; i < 100; ++i) {
    watch.on_command(kNed);
    watch.on_command(0);
  }
  watch.on_command(kDepth);
  const auto waiting = changes(&watch);
  EXPECT_EQ(waiting.size(), ProblemWatch::kWaiting);
  EXPECT_EQ(waiting.back(), kDepthNumber);
}

TEST(ProblemWatch, BitsOfANewerServerAreKeptButNotTold) {
  ProblemWatch watch;
  watch.on_command(protocol::Problems{1} << 63);
  EXPECT_EQ(watch.now(), protocol::Problems{1} << 63);
  EXPECT_FALSE(watch.next().has_value());
}

TEST(ProblemWatch, AllocatesNothing) {
  ProblemWatch watch;
  const test::AllocationTrap trap;
  watch.on_command(kNed | kDepth);
  watch.on_telemetry(0);
  while (watch.next()) {
  }
  EXPECT_EQ(trap.count(), 0u);
}

}  // namespace
}  // namespace gatefield::sdk
