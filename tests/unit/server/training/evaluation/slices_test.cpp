#include "server/training/evaluation/slices.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <opencv2/imgcodecs.hpp>

namespace gatefield::training {
namespace {

using ::testing::HasSubstr;

class Slices : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() / ("gatefield-slices-" + std::to_string(::getpid()));
    std::filesystem::create_directories(folder_);
    auto bundle = model::Bundle::read(std::filesystem::path(GATEFIELD_SOURCE_DIR) / "deploy/models/race");
    ASSERT_TRUE(bundle.ok()) << bundle.error();
    bundle_ = std::make_unique<model::Bundle>(std::move(bundle).value());
    auto observer = Observer::create(*bundle_);
    ASSERT_TRUE(observer.ok()) << observer.error();
    observer_ = std::move(observer).value();
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::filesystem::path folder_;
  std::unique_ptr<model::Bundle> bundle_;
  std::unique_ptr<Observer> observer_;
};

TEST_F(Slices, SixConditionsInOnePictureTheSameEveryTime) {
  ASSERT_TRUE(draw_occlusions(observer_.get(), 5, folder_ / "a.png").ok());
  ASSERT_TRUE(draw_occlusions(observer_.get(), 5, folder_ / "b.png").ok());
  const cv::Mat a = cv::imread((folder_ / "a.png").string());
  const cv::Mat b = cv::imread((folder_ / "b.png").string());
  ASSERT_GT(a.cols, 1500);
  ASSERT_GT(a.rows, 900);
  EXPECT_EQ(cv::norm(a, b), 0.0);
  EXPECT_THAT(draw_occlusions(observer_.get(), 5, folder_ / "none" / "a.png").error(), HasSubstr("can't be written"));
}

TEST_F(Slices, SideBySideTakesFramesThatShowAGate) {
  DatasetOptions set;
  set.seed = 1'000'033;
  set.count = 24;
  set.threads = 1;
  ASSERT_TRUE(generate_dataset(folder_ / "set.h5", set).ok());
  const auto dataset = Dataset::open(folder_ / "set.h5");
  ASSERT_TRUE(dataset.ok()) << dataset.error();
  const Status drawn =
      draw_side_by_side({{"one", observer_.get()}, {"two", observer_.get()}}, *dataset, 3, 5, folder_ / "c.png");
  ASSERT_TRUE(drawn.ok()) << drawn.error();
  EXPECT_GT(cv::imread((folder_ / "c.png").string()).cols, 900);

  set.count = 0;
  ASSERT_TRUE(generate_dataset(folder_ / "empty.h5", set).ok());
  const auto empty = Dataset::open(folder_ / "empty.h5");
  ASSERT_TRUE(empty.ok()) << empty.error();
  EXPECT_THAT(draw_side_by_side({{"one", observer_.get()}}, *empty, 3, 5, folder_ / "d.png").error(),
              HasSubstr("no frame of the set"));
}

}  // namespace
}  // namespace gatefield::training
