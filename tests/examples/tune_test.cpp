// The file of docs/tuning.md, with course and vehicle of docs/courses-and-vehicles.md beside it.
#include "client/race/tune/tune.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>

#include "tests/examples/page.h"

namespace gatefield::race {
namespace {

TEST(TuningPage, TheFileLoads) {
  const auto docs = std::filesystem::path(GATEFIELD_SOURCE_DIR) / "docs";
  const auto folder = std::filesystem::temp_directory_path() / ("gatefield-tuning-" + std::to_string(getpid()));
  test::write_files(test::shown_files(docs / "courses-and-vehicles.md"), folder);
  test::write_files(test::shown_files(docs / "tuning.md"), folder);
  const auto tune = load_tune(folder / "my/tune.txt");
  std::filesystem::remove_all(folder);
  ASSERT_TRUE(tune) << tune.error();
  EXPECT_EQ(tune->races.cells.size(), 1u);
  EXPECT_EQ(tune->budget.trials, 600u);
}

}  // namespace
}  // namespace gatefield::race
