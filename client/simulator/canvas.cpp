#include "client/simulator/canvas.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "common/base/text.h"
#include "common/base/whole_file.h"

namespace gatefield::simulator {
namespace {

constexpr int kScale = 2;  // drawn so many times larger
constexpr int kShift = 4;  // fractional bits of OpenCV's coordinates
constexpr int kFont = cv::FONT_HERSHEY_DUPLEX;
constexpr double kCapital_px = 21.0;  // height of a capital letter of that font at scale 1

int stroke(double width) { return width < 0 ? cv::FILLED : std::max(1, static_cast<int>(std::lround(width * kScale))); }
double font_scale(double height) { return height * kScale / kCapital_px; }
int font_stroke(double height, bool bold) {
  return std::max(1, static_cast<int>(std::lround(height * kScale * (bold ? 0.16 : 0.09))));
}

}  // namespace

Canvas::Canvas(int width, int height, const cv::Scalar& background)
    : sheet_(height * kScale, width * kScale, CV_8UC3, background) {}

cv::Point Canvas::fixed(const Eigen::Vector2d& p) const {
  constexpr double kFactor = kScale * (1 << kShift);
  return {static_cast<int>(std::lround(p.x() * kFactor)), static_cast<int>(std::lround(p.y() * kFactor))};
}

void Canvas::line(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const cv::Scalar& color, double width) {
  cv::line(sheet_, fixed(a), fixed(b), color, stroke(width), cv::LINE_AA, kShift);
}

void Canvas::dashed_line(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const cv::Scalar& color, double width,
                         double dash) {
  const double length = (b - a).norm();
  for (double s = 0; s < length; s += 2 * dash)
    line(a + (b - a) * (s / length), a + (b - a) * (std::min(s + dash, length) / length), color, width);
}

void Canvas::circle(const Eigen::Vector2d& center, double radius, const cv::Scalar& color, double width) {
  cv::circle(sheet_, fixed(center), static_cast<int>(std::lround(radius * kScale * (1 << kShift))), color,
             stroke(width), cv::LINE_AA, kShift);
}

void Canvas::polygon(const std::vector<Eigen::Vector2d>& corners, const cv::Scalar& color, double opacity) {
  std::vector<cv::Point> points;
  std::vector<cv::Point> whole;
  for (const auto& corner : corners) {
    points.push_back(fixed(corner));
    whole.emplace_back(points.back().x >> kShift, points.back().y >> kShift);
  }
  if (opacity >= 1.0) return cv::fillConvexPoly(sheet_, points, color, cv::LINE_AA, kShift);
  cv::Rect region = cv::boundingRect(whole);
  region = (cv::Rect(region.x - 2, region.y - 2, region.width + 4, region.height + 4)) & cv::Rect({}, sheet_.size());
  if (region.empty()) return;
  cv::Mat part = sheet_(region), covered = part.clone();
  for (auto& point : points) point -= cv::Point(region.x << kShift, region.y << kShift);
  cv::fillConvexPoly(covered, points, color, cv::LINE_AA, kShift);
  cv::addWeighted(covered, opacity, part, 1.0 - opacity, 0.0, part);
}

void Canvas::rectangle(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const cv::Scalar& color, double width) {
  cv::rectangle(sheet_, fixed(a), fixed(b), color, stroke(width), cv::LINE_AA, kShift);
}

double Canvas::text_width(const std::string& what, double height, bool bold) {
  int baseline = 0;
  return cv::getTextSize(what, kFont, font_scale(height), font_stroke(height, bold), &baseline).width /
         static_cast<double>(kScale);
}

void Canvas::text(const std::string& what, const Eigen::Vector2d& at, double height, const cv::Scalar& color,
                  Align align, bool bold) {
  const double width = text_width(what, height, bold);
  const double x = at.x() - (align == Align::kLeft ? 0.0 : align == Align::kCenter ? 0.5 * width : width);
  cv::putText(sheet_, what, {static_cast<int>(std::lround(x * kScale)), static_cast<int>(std::lround(at.y() * kScale))},
              kFont, font_scale(height), color, font_stroke(height, bold), cv::LINE_AA);
}

void Canvas::vertical_text(const std::string& what, const Eigen::Vector2d& center, double height,
                           const cv::Scalar& color) {
  const int width = static_cast<int>(std::ceil(text_width(what, height))) + 4,
            rows = static_cast<int>(std::ceil(2 * height));
  Canvas flat(width, rows);
  flat.text(what, {0.5 * width, 1.5 * height}, height, color, Align::kCenter);
  cv::Mat upright;
  cv::rotate(flat.sheet_, upright, cv::ROTATE_90_COUNTERCLOCKWISE);
  const cv::Rect wanted(static_cast<int>(std::lround(center.x() * kScale)) - upright.cols / 2,
                        static_cast<int>(std::lround(center.y() * kScale)) - upright.rows / 2, upright.cols,
                        upright.rows);
  const cv::Rect fits = wanted & cv::Rect({}, sheet_.size());
  if (!fits.empty()) upright(fits - wanted.tl()).copyTo(sheet_(fits));
}

void Canvas::image(const cv::Mat& picture, const Eigen::Vector2d& top_left, double width, double height) {
  const cv::Rect place(static_cast<int>(std::lround(top_left.x() * kScale)),
                       static_cast<int>(std::lround(top_left.y() * kScale)),
                       static_cast<int>(std::lround(width * kScale)), static_cast<int>(std::lround(height * kScale)));
  cv::Mat scaled;
  cv::resize(picture, scaled, place.size(), 0, 0, cv::INTER_NEAREST);
  scaled.copyTo(sheet_(place));
}

cv::Mat Canvas::finish() const {
  cv::Mat out;
  cv::resize(sheet_, out, {sheet_.cols / kScale, sheet_.rows / kScale}, 0, 0, cv::INTER_AREA);
  return out;
}

Status Canvas::save(const std::filesystem::path& file) const { return write_png(file, finish()); }

Status write_png(const std::filesystem::path& file, const cv::Mat& picture) {
  std::vector<std::uint8_t> bytes;
  cv::imencode(".png", picture, bytes);
  return write_file(file, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

cv::Scalar ramp_color(double share) {
  static const cv::Mat table = [] {
    cv::Mat levels(1, 256, CV_8UC1), colors;
    for (int i = 0; i < 256; ++i) levels.at<std::uint8_t>(0, i) = static_cast<std::uint8_t>(i);
    cv::applyColorMap(levels, colors, cv::COLORMAP_TURBO);
    return colors;
  }();
  const auto& color = table.at<cv::Vec3b>(0, static_cast<int>(std::lround(std::clamp(share, 0.0, 1.0) * 255)));
  return {static_cast<double>(color[0]), static_cast<double>(color[1]), static_cast<double>(color[2])};
}

double tick_step(double span, int most) {
  double step = std::pow(10.0, std::floor(std::log10(std::max(span, 1e-9) / most)));
  for (const double factor : {1.0, 2.0, 5.0, 10.0})
    if (span / (factor * step) <= most) return factor * step;
  return 10.0 * step;
}

std::string tick_label(double value, double step) {
  const int digits = std::max(0, -static_cast<int>(std::floor(std::log10(step) + 1e-9)));
  return gatefield::fixed(std::abs(value) < 1e-9 ? 0.0 : value, digits);
}

void draw_color_bar(Canvas* canvas, const Eigen::Vector2d& top_left, double width, double height, double low,
                    double high, const std::string& caption) {
  const cv::Scalar ink(70, 60, 50);
  const int rows = static_cast<int>(height);
  for (int row = 0; row < rows; ++row)
    canvas->rectangle(top_left + Eigen::Vector2d(0, row), top_left + Eigen::Vector2d(width, row + 1),
                      ramp_color(1.0 - (row + 0.5) / rows), -1);
  canvas->rectangle(top_left, top_left + Eigen::Vector2d(width, height), ink, 1);
  const double step = tick_step(high - low, 6);
  for (double value = std::ceil(low / step - 1e-9) * step; value <= high + 1e-9 * step; value += step) {
    const double y = top_left.y() + height * (1.0 - (value - low) / (high - low));
    canvas->line({top_left.x() + width, y}, {top_left.x() + width + 5, y}, ink, 1);
    canvas->text(tick_label(value, step), {top_left.x() + width + 9, y + 5}, 10, ink);
  }
  canvas->text(caption, top_left + Eigen::Vector2d(0.5 * width + 8, -14), 11, ink, Align::kCenter);
}

}  // namespace gatefield::simulator
