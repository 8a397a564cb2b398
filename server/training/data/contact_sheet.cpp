#include "server/training/data/contact_sheet.h"

#include <algorithm>
#include <array>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

namespace gatefield::training {
namespace {

constexpr int kZoom = 2;
constexpr int kColumns = 4;  ///< pairs (clean, noisy) in a row
constexpr int kBorder_px = 3;

/// Depth in colour, near red to far blue, evenly in inverse depth so that near things keep their contrast; 0 is black.
cv::Mat coloured(const std::vector<float>& depth_m) {
  const CameraModel& camera = dataset_camera();
  const double nearest = 1.0 / camera.min_depth_m;
  const double farthest = 1.0 / camera.max_depth_m;
  cv::Mat shade(kImageHeight_px, kImageWidth_px, CV_8UC1);
  cv::Mat nothing(kImageHeight_px, kImageWidth_px, CV_8UC1);
  for (int v = 0; v < kImageHeight_px; ++v) {
    for (int u = 0; u < kImageWidth_px; ++u) {
      const double z_m = depth_m[static_cast<std::size_t>(v * kImageWidth_px + u)];
      const double closeness = z_m > 0.0 ? (1.0 / z_m - farthest) / (nearest - farthest) : 0.0;
      shade.at<std::uint8_t>(v, u) = static_cast<std::uint8_t>(255.0 * std::sqrt(std::clamp(closeness, 0.0, 1.0)));
      nothing.at<std::uint8_t>(v, u) = z_m > 0.0 ? 0 : 255;
    }
  }
  cv::Mat picture;
  cv::applyColorMap(shade, picture, cv::COLORMAP_TURBO);
  picture.setTo(cv::Scalar(0, 0, 0), nothing);
  cv::resize(picture, picture, {}, kZoom, kZoom, cv::INTER_NEAREST);
  return picture;
}

/// Outline of one edge of the frame, cut where it goes behind the camera.
void draw_outline(const GateLabel& gate, double half_m, const cv::Scalar& colour, cv::Mat* picture) {
  const CameraModel& camera = dataset_camera();
  constexpr int kSteps = 64;
  constexpr float kNearest_m = 0.05f;
  const Eigen::Isometry3f X_CG = gate.X_CG();
  const auto corner = [&](int step) -> Eigen::Vector3f {
    const auto h = static_cast<float>(half_m);
    if (gate.shape.opening == GateShape::Opening::kRound) {
      const float angle_rad = 6.2831853f * static_cast<float>(step) / kSteps;
      return X_CG * Eigen::Vector3f(0, h * std::cos(angle_rad), h * std::sin(angle_rad));
    }
    constexpr int kPerSide = kSteps / 4;
    const float along = h * (2.0f * static_cast<float>(step % kPerSide) / kPerSide - 1.0f);
    switch (step / kPerSide % 4) {
      case 0:
        return X_CG * Eigen::Vector3f(0, along, -h);
      case 1:
        return X_CG * Eigen::Vector3f(0, h, along);
      case 2:
        return X_CG * Eigen::Vector3f(0, -along, h);
      default:
        return X_CG * Eigen::Vector3f(0, -h, -along);
    }
  };
  const auto project = [&](const Eigen::Vector3f& p_C) {
    return cv::Point2d(kZoom * (camera.fx_px * p_C.x() / p_C.z() + camera.cx_px),
                       kZoom * (camera.fy_px * p_C.y() / p_C.z() + camera.cy_px));
  };
  for (int step = 0; step < kSteps; ++step) {
    const Eigen::Vector3f a_C = corner(step);
    const Eigen::Vector3f b_C = corner((step + 1) % kSteps);
    if (a_C.z() > kNearest_m && b_C.z() > kNearest_m) {
      const cv::Point2d a = project(a_C);
      const cv::Point2d b = project(b_C);
      if (std::max({std::abs(a.x), std::abs(a.y), std::abs(b.x), std::abs(b.y)}) > 1e4) continue;
      cv::line(*picture, a, b, colour, 1, cv::LINE_AA);
    }
  }
}

}  // namespace

Status write_contact_sheet(const Dataset& dataset, int count, const scene::SensorNoise& noise,
                           const std::filesystem::path& png) {
  const auto size = static_cast<int>(std::min<std::uint64_t>(dataset.size(), 1'000'000'000));
  if (size == 0 || count <= 0) return Error{"contact sheet " + png.string() + ": there are no samples to show"};
  const int shown = std::min(count, size);
  const int rows = (shown + kColumns - 1) / kColumns;
  const int cell_width = 2 * kImageWidth_px * kZoom + 2 * kBorder_px;
  const int cell_height = kImageHeight_px * kZoom + kBorder_px;
  cv::Mat sheet(rows * cell_height, std::min(shown, kColumns) * cell_width, CV_8UC3, cv::Scalar(90, 90, 90));

  Random random(dataset.seed(), ~std::uint64_t{0});
  std::vector<float> depth_m(kImageSize_px);
  for (int i = 0; i < shown; ++i) {
    const auto index = static_cast<std::uint64_t>(i) * dataset.size() / static_cast<std::uint64_t>(shown);
    const SampleView sample = dataset.at(index);
    const int x = i % kColumns * cell_width;
    const int y = i / kColumns * cell_height;

    draw_clean(sample, depth_m);
    cv::Mat clean = coloured(depth_m);
    for (int g = sample.gate_count - 1; g >= 0; --g) {
      const GateLabel& gate = sample.gates[static_cast<std::size_t>(g)];
      const cv::Scalar colour = gate.valid() ? cv::Scalar(255, 255, 255) : cv::Scalar(130, 130, 130);
      draw_outline(gate, gate.shape.inner_half_m, colour, &clean);
      draw_outline(gate, gate.shape.outer_half_m, colour, &clean);
    }
    cv::putText(
        clean,
        std::to_string(index) + ": " + std::to_string(sample.valid_count) + " of " + std::to_string(sample.gate_count),
        {4, 12}, cv::FONT_HERSHEY_SIMPLEX, 0.38, cv::Scalar(255, 255, 255), 1, cv::LINE_AA);
    clean.copyTo(sheet(cv::Rect(x, y, clean.cols, clean.rows)));

    draw_noisy(sample, noise, &random, depth_m);
    const cv::Mat noisy = coloured(depth_m);
    noisy.copyTo(sheet(cv::Rect(x + clean.cols + kBorder_px, y, noisy.cols, noisy.rows)));
  }
  if (png.has_parent_path()) {
    std::error_code error;
    std::filesystem::create_directories(png.parent_path(), error);
    if (error) return Error{"contact sheet " + png.string() + ": the folder can't be made: " + error.message()};
  }
  bool written = false;
  try {
    written = cv::imwrite(png.string(), sheet);
  } catch (const cv::Exception& exception) {
    return Error{"contact sheet " + png.string() + ": can't be written: " + exception.what()};
  }
  if (!written) return Error{"contact sheet " + png.string() + ": can't be written"};
  return {};
}

}  // namespace gatefield::training
