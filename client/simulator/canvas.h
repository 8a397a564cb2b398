#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "common/base/result.h"

namespace gatefield::simulator {

enum class Align { kLeft, kCenter, kRight };

/// A sheet to draw on, in its own pixels with fractions, drawn at twice the size and scaled down in the end, so that
/// thin lines, slants and letters come out smooth. Colours are BGR as OpenCV has them.
/// Thread-safe: no.   Real-time safe: no.
class Canvas {
 public:
  Canvas(int width, int height, const cv::Scalar& background = {255, 255, 255});

  void line(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const cv::Scalar& color, double width = 1.0);
  void dashed_line(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const cv::Scalar& color, double width,
                   double dash);
  /// @param width  below 0: filled
  void circle(const Eigen::Vector2d& center, double radius, const cv::Scalar& color, double width);
  /// Convex, filled; opacity 0 to 1.
  void polygon(const std::vector<Eigen::Vector2d>& corners, const cv::Scalar& color, double opacity = 1.0);
  /// @param width  below 0: filled
  void rectangle(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const cv::Scalar& color, double width);
  /// Text on its baseline; `height` of a capital letter in pixels. ASCII.
  void text(const std::string& what, const Eigen::Vector2d& at, double height, const cv::Scalar& color,
            Align align = Align::kLeft, bool bold = false);
  void vertical_text(const std::string& what, const Eigen::Vector2d& center, double height, const cv::Scalar& color);
  static double text_width(const std::string& what, double height, bool bold = false);
  void image(const cv::Mat& picture, const Eigen::Vector2d& top_left, double width, double height);

  cv::Mat finish() const;
  /// The finished sheet as a PNG file. Errors: as write_file().
  Status save(const std::filesystem::path& file) const;

 private:
  cv::Point fixed(const Eigen::Vector2d& p) const;
  cv::Mat sheet_;
};

/// A picture as a PNG file. Errors: as write_file().
Status write_png(const std::filesystem::path& file, const cv::Mat& picture);

/// Colour for a share of 0 to 1, dark blue over green to red.
cv::Scalar ramp_color(double share);

/// Step of 1, 2 or 5 times a power of ten that cuts `span` into at most `most` parts.
double tick_step(double span, int most);
/// "2", "0.5": as short as it can be for a multiple of `step`.
std::string tick_label(double value, double step);

/// Draws a colour bar with ticks and a caption, upright, its body at the given place.
void draw_color_bar(Canvas* canvas, const Eigen::Vector2d& top_left, double width, double height, double low,
                    double high, const std::string& caption);

}  // namespace gatefield::simulator
