#include "server/training/data/contact_sheet.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <span>
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

cv::Mat coloured(std::span<const std::uint16_t> depth_mm) {
  std::vector<float> depth_m(depth_mm.size());
  std::ranges::transform(depth_mm, depth_m.begin(), [](std::uint16_t z) { return 0.001f * static_cast<float>(z); });
  return coloured(depth_m);
}

/// Draws one gate into the picture of its sample: inner and outer edge, cut where they go behind the camera. Every
/// second piece of what something else hides is left out, so that it looks dashed.
class OutlinePainter {
 public:
  OutlinePainter(const SampleView& sample, cv::Mat* picture) : depth_mm_(sample.reference_mm()), picture_(picture) {}

  void draw(const GateLabel& gate, bool target) const {
    // Valid gates white, the target's with a dot in its middle, others grey.
    const cv::Scalar colour = gate.valid() ? cv::Scalar(255, 255, 255) : cv::Scalar(150, 150, 150);
    draw_edge(gate, gate.shape.inner_half_m, colour);
    draw_edge(gate, gate.shape.outer_half_m, colour);
    if (gate.p_CG.z() < kNearest_m) return;
    const cv::Point2d middle = project(gate.p_CG);
    if (middle.x < 0 || middle.y < 0 || middle.x >= picture_->cols || middle.y >= picture_->rows) return;
    if (target) cv::circle(*picture_, middle, 2, colour, cv::FILLED, cv::LINE_AA);
    const std::string seen = std::to_string(static_cast<int>(std::lround(100.0f * gate.visible_fraction))) + "%";
    cv::putText(*picture_, seen, middle + cv::Point2d(4, -3), cv::FONT_HERSHEY_SIMPLEX, 0.3, colour, 1, cv::LINE_AA);
  }

 private:
  static constexpr int kSteps = 64;
  static constexpr float kNearest_m = 0.05f;

  static Eigen::Vector3f corner(const GateLabel& gate, float half_m, int step) {
    const Eigen::Isometry3f X_CG = gate.X_CG();
    if (gate.shape.opening == GateShape::Opening::kRound) {
      const float angle_rad = 2.0f * std::numbers::pi_v<float> * static_cast<float>(step) / kSteps;
      return X_CG * Eigen::Vector3f(0, half_m * std::cos(angle_rad), half_m * std::sin(angle_rad));
    }
    constexpr int kPerSide = kSteps / 4;
    const float along_m = half_m * (2.0f * static_cast<float>(step % kPerSide) / kPerSide - 1.0f);
    switch (step / kPerSide % 4) {
      case 0:
        return X_CG * Eigen::Vector3f(0, along_m, -half_m);
      case 1:
        return X_CG * Eigen::Vector3f(0, half_m, along_m);
      case 2:
        return X_CG * Eigen::Vector3f(0, -along_m, half_m);
      default:
        return X_CG * Eigen::Vector3f(0, -half_m, -along_m);
    }
  }

  static cv::Point2d project(const Eigen::Vector3f& p_C) {
    const CameraModel& camera = dataset_camera();
    return {kZoom * (camera.fx_px * p_C.x() / p_C.z() + camera.cx_px),
            kZoom * (camera.fy_px * p_C.y() / p_C.z() + camera.cy_px)};
  }

  bool hidden(const Eigen::Vector3f& p_C) const {
    constexpr float kTolerance_m = 0.15f;
    const cv::Point2d at = project(p_C) / kZoom;
    if (at.x < 0 || at.y < 0 || at.x >= kImageWidth_px || at.y >= kImageHeight_px) return false;
    const auto i = static_cast<std::size_t>(static_cast<int>(at.y) * kImageWidth_px + static_cast<int>(at.x));
    const float shown_m = 0.001f * static_cast<float>(depth_mm_[i]);
    return shown_m > 0.0f && shown_m < p_C.z() - kTolerance_m;
  }

  void draw_edge(const GateLabel& gate, double half_m, const cv::Scalar& colour) const {
    const auto half = static_cast<float>(half_m);
    for (int step = 0; step < kSteps; ++step) {
      const Eigen::Vector3f a_C = corner(gate, half, step);
      const Eigen::Vector3f b_C = corner(gate, half, (step + 1) % kSteps);
      if (a_C.z() <= kNearest_m || b_C.z() <= kNearest_m) continue;
      if (step % 2 == 1 && hidden(0.5f * (a_C + b_C))) continue;
      const cv::Point2d a = project(a_C);
      const cv::Point2d b = project(b_C);
      if (std::max({std::abs(a.x), std::abs(a.y), std::abs(b.x), std::abs(b.y)}) > 1e4) continue;
      cv::line(*picture_, a, b, colour, 1, cv::LINE_AA);
    }
  }

  std::span<const std::uint16_t> depth_mm_;
  cv::Mat* picture_;
};

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

    cv::Mat left = coloured(sample.reference_mm());
    const OutlinePainter painter(sample, &left);
    for (int g = sample.gate_count - 1; g >= 0; --g)
      painter.draw(sample.gates[static_cast<std::size_t>(g)], g < sample.valid_count && g == 0);
    std::string title =
        std::to_string(index) + ": " + std::to_string(sample.valid_count) + " of " + std::to_string(sample.gate_count);
    if (sample.sequence) title += ", sequence " + std::to_string(*sample.sequence);
    cv::putText(left, title, {4, 12}, cv::FONT_HERSHEY_SIMPLEX, 0.38, cv::Scalar(255, 255, 255), 1, cv::LINE_AA);
    left.copyTo(sheet(cv::Rect(x, y, left.cols, left.rows)));

    draw_noisy(sample, noise, &random, depth_m);
    const cv::Mat right = coloured(depth_m);
    right.copyTo(sheet(cv::Rect(x + left.cols + kBorder_px, y, right.cols, right.rows)));
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
