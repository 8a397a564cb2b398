#include "server/training/evaluation/evaluate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <set>
#include <sstream>
#include <string>

#include "server/training/evaluation/report.h"
#include "server/training/evaluation/selection.h"

namespace gatefield::training {
namespace {

using ::testing::HasSubstr;

/// The shipped bundle on a handful of images: what is tested here is the way there, not how good it is.
class Evaluate : public ::testing::Test {
 protected:
  static constexpr std::uint64_t kImages = 24;

  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() / ("gatefield-evaluate-" + std::to_string(::getpid()));
    DatasetOptions set;
    set.seed = 1'000'033;
    set.count = kImages;
    set.threads = 1;
    ASSERT_TRUE(generate_dataset(folder_ / "set.h5", set).ok());
    options_.bundle = std::filesystem::path(GATEFIELD_SOURCE_DIR) / "deploy/models/race";
    options_.datasets = {folder_ / "set.h5"};
    options_.two_gates.count = 2;
    options_.approach.count = 1;
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::filesystem::path folder_;
  EvaluateOptions options_;
};

TEST_F(Evaluate, SameFiguresWithAnyNumberOfThreads) {
  const auto one = evaluate(options_);
  ASSERT_TRUE(one.ok()) << one.error();
  options_.threads = 3;
  const auto three = evaluate(options_);
  ASSERT_TRUE(three.ok()) << three.error();
  EXPECT_EQ(to_csv(*one), to_csv(*three));
  EXPECT_EQ(to_text(*one), to_text(*three));
}

TEST_F(Evaluate, MeasuresEveryImageInBothModesAndBeatsTheConstant) {
  options_.two_gates.count = 0;
  options_.approach.count = 0;
  const auto evaluation = evaluate(options_);
  ASSERT_TRUE(evaluation.ok()) << evaluation.error();
  const HeldOut& frames = evaluation->sets[0].frames;
  EXPECT_EQ(frames.truth.size(), kImages);
  for (const Mode mode : kModes) {
    const Selected all = select(frames, 0, mode);
    ASSERT_GT(all.truth.size(), kImages / 2);
    // The median: among two dozen images one on which the first look takes another gate decides the mean.
    EXPECT_LT(summarize(all.measured, 0.5).box_median_m, 0.7 * constant_baseline(all.truth).box_m);
  }
  EXPECT_TRUE(evaluation->two_gates.empty());
  EXPECT_TRUE(evaluation->approaches.empty());
}

TEST_F(Evaluate, WritesItsReport) {
  options_.against = {Named("the same again", options_.bundle.path)};
  const auto evaluation = evaluate(options_);
  ASSERT_TRUE(evaluation.ok()) << evaluation.error();
  const auto written = write_report(*evaluation, folder_ / "report");
  ASSERT_TRUE(written.ok()) << written.error();
  for (const char* file : {"evaluation.txt", "evaluation.md", "evaluation.csv", "roc-set.csv", "calibration-set.gp"})
    EXPECT_TRUE(std::filesystem::exists(folder_ / "report" / file)) << file;
  EXPECT_THAT(to_text(*evaluation), HasSubstr("Bundles side by side, set"));
  EXPECT_THAT(to_text(*evaluation), HasSubstr("Only "));
  // Every figure can be found by its table, row and column.
  std::istringstream csv(to_csv(*evaluation));
  std::set<std::string> keys;
  for (std::string line; std::getline(csv, line);) {
    EXPECT_TRUE(keys.insert(line.substr(0, line.rfind(','))).second) << line;
  }
  EXPECT_GT(keys.size(), 1000u);
}

TEST_F(Evaluate, CanBeStopped) {
  const auto evaluation = evaluate(options_, [](double) { return false; });
  ASSERT_FALSE(evaluation.ok());
  EXPECT_EQ(evaluation.error(), "evaluation stopped");
}

TEST_F(Evaluate, SaysWhatIsWrong) {
  EvaluateOptions twice = options_;
  twice.against = {options_.bundle};
  EXPECT_THAT(evaluate(twice).error(), HasSubstr("two are called bundle race"));
  EvaluateOptions none = options_;
  none.datasets.clear();
  EXPECT_THAT(evaluate(none).error(), HasSubstr("no data set"));
  EvaluateOptions missing = options_;
  missing.datasets = {folder_ / "other.h5"};
  EXPECT_THAT(evaluate(missing).error(), HasSubstr("other.h5"));
  missing = options_;
  missing.bundle = folder_ / "nobody";
  EXPECT_THAT(evaluate(missing).error(), HasSubstr("nobody"));
}

TEST(NamedPath, TakesItsNameFromThePathOrTheWord) {
  EXPECT_EQ(Named::parse("deploy/models/race").name, "race");
  EXPECT_EQ(Named::parse("deploy/models/race/").name, "race");
  EXPECT_EQ(Named::parse("x/held-out.h5").name, "held-out");
  EXPECT_EQ(Named::parse("stage 1=x/y").name, "stage 1");
  EXPECT_EQ(Named::parse("stage 1=x/y").path, "x/y");
}

}  // namespace
}  // namespace gatefield::training
