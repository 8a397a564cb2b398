#include "server/training/data/depth_frames.h"

#include <gmock/gmock.h>

#include "tests/unit/server/training/data/frame_folder.h"

namespace gatefield::training {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using DepthFramesTest = FrameFolderFixture;

TEST_F(DepthFramesTest, PngAndRawAreReadInOrderOfTheirNames) {
  put_camera(32, 20, 25.0);
  put_png("b.png", 32, 20, std::vector<float>(640, 2.5f));
  std::ofstream raw(folder_ / "a.raw", std::ios::binary);
  for (int i = 0; i < 640; ++i) raw.put(static_cast<char>(0x10)).put(static_cast<char>(0x27));  // 10000
  raw.close();
  std::ofstream(folder_ / "notes.txt") << "not an image";
  const auto frames = find_frames({folder_});
  ASSERT_TRUE(frames.ok()) << frames.error();
  ASSERT_EQ(frames->images.size(), 2u);
  EXPECT_EQ(frames->camera.model.width_px, 32);
  const auto first = read_frame(*frames, 0), second = read_frame(*frames, 1);
  ASSERT_TRUE(first.ok() && second.ok());
  EXPECT_FLOAT_EQ((*first)[639], 10.0f);
  EXPECT_FLOAT_EQ((*second)[0], 2.5f);
}

TEST_F(DepthFramesTest, DepthsBeyondTheRangeAreReadAndCutWhenAsked) {
  put_camera(32, 20, 25.0);
  put_png("a.png", 32, 20, std::vector<float>(640, 42.0f));
  const auto frames = find_frames({folder_});
  ASSERT_TRUE(frames.ok()) << frames.error();
  auto image = read_frame(*frames, 0);
  ASSERT_TRUE(image.ok());
  EXPECT_FLOAT_EQ((*image)[0], 42.0f);
  cut_to_range(frames->camera.model, &image.value());
  EXPECT_EQ((*image)[0], 0.0f);
}

TEST_F(DepthFramesTest, IntrinsicsCanBeTold) {
  put_png("a.png", 32, 20, std::vector<float>(640, 2.0f));
  FrameFolder where{folder_};
  where.intrinsics_px = {25.0, 26.0, 16.0, 10.0};
  const auto frames = find_frames(where);
  ASSERT_TRUE(frames.ok()) << frames.error();
  EXPECT_EQ(frames->camera.model.width_px, 32);
  EXPECT_EQ(frames->camera.model.height_px, 20);
  EXPECT_DOUBLE_EQ(frames->camera.model.fy_px, 26.0);
  where.intrinsics_px = {25.0, 26.0, 99.0, 10.0};
  EXPECT_THAT(find_frames(where).error(), HasSubstr("cx_px"));
}

TEST_F(DepthFramesTest, ErrorsSayWhatIsMissing) {
  EXPECT_THAT(find_frames({folder_ / "nowhere"}).error(), HasSubstr("nowhere"));
  EXPECT_THAT(find_frames({folder_}).error(), HasSubstr("no frames"));
  put_png("a.png", 32, 20, std::vector<float>(640, 2.0f));
  EXPECT_THAT(find_frames({folder_}).error(), AllOf(HasSubstr("camera.txt"), HasSubstr("--intrinsics")));
  put_camera(64, 40, 25.0);
  const auto frames = find_frames({folder_});
  ASSERT_TRUE(frames.ok());
  EXPECT_THAT(read_frame(*frames, 0).error(), AllOf(HasSubstr("a.png"), HasSubstr("32 x 20"), HasSubstr("64 x 40")));
  std::ofstream(folder_ / "b.raw") << "short";
  EXPECT_THAT(read_frame(*find_frames({folder_}), 1).error(), AllOf(HasSubstr("b.raw"), HasSubstr("5120")));
}

}  // namespace
}  // namespace gatefield::training
