#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

namespace gatefield::training {

/// A folder of depth images that is gone when the test is.
class FrameFolderFixture : public testing::Test {
 protected:
  FrameFolderFixture() {
    folder_ = std::filesystem::temp_directory_path() / ("gatefield_frames_" + std::to_string(::getpid()) + "_" +
                                                        testing::UnitTest::GetInstance()->current_test_info()->name());
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
  }
  ~FrameFolderFixture() override { std::filesystem::remove_all(folder_); }

  void put_camera(int width, int height, double f_px) const {
    std::ofstream(folder_ / "camera.txt")
        << "width_px " << width << "\nheight_px " << height << "\nfx_px " << f_px << "\nfy_px " << f_px << "\ncx_px "
        << 0.5 * width << "\ncy_px " << 0.5 * height << "\n";
  }
  /// Depths in metres as millimetres.
  void put_png(const std::string& name, int width, int height, const std::vector<float>& depth_m) const {
    cv::Mat image(height, width, CV_16UC1);
    for (int v = 0; v < height; ++v)
      for (int u = 0; u < width; ++u)
        image.at<std::uint16_t>(v, u) =
            static_cast<std::uint16_t>(1000.0f * depth_m[static_cast<std::size_t>(v) * width + u] + 0.5f);
    ASSERT_TRUE(cv::imwrite((folder_ / name).string(), image));
  }

  std::filesystem::path folder_;
};

}  // namespace gatefield::training
