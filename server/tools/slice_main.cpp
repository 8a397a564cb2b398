// gatefield-slice: what the learned field says, drawn over the depth frame that it comes from.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <vector>

#include "common/config/frame.h"
#include "common/model/bundle.h"
#include "server/perception/depth_encoder.h"
#include "server/perception/gate_memory.h"
#include "server/perception/hourglass_fit.h"

namespace gatefield {
namespace {

constexpr int kScale = 6;           ///< depth pixels to picture pixels
constexpr int kMapSize_px = 300;    ///< one top-down map
constexpr double kMapHalf_m = 2.5;  ///< half of what a map shows
constexpr double kOverlay_m = 1.3;  ///< half-width of the slice that is laid over the depth image
constexpr double kHeights_m[] = {0.4, 0.0, -0.4};
constexpr int kBorder_px = 16;
constexpr int kCaption_px = 26;
const cv::Scalar kPaper(255, 255, 255);
const cv::Scalar kInk(40, 40, 40);
const cv::Scalar kTruth(200, 60, 30);

/// Red where s < 0, white at 0, green where s > 0; saturates at 1 m.
cv::Vec3b field_color(double s) {
  const double share = std::clamp(std::abs(s), 0.0, 1.0);
  const auto mix = [share](int end) { return cv::saturate_cast<uchar>(255.0 + share * (end - 255)); };
  return s >= 0 ? cv::Vec3b(mix(60), mix(150), mix(20)) : cv::Vec3b(mix(30), mix(30), mix(190));
}

std::vector<float> evaluate(const planner::Field& field, const std::vector<Eigen::Vector3d>& points_W) {
  std::vector<float> x, y, z, s(points_W.size());
  for (const Eigen::Vector3d& p : points_W) {
    x.push_back(static_cast<float>(p.x()));
    y.push_back(static_cast<float>(p.y()));
    z.push_back(static_cast<float>(p.z()));
  }
  field.evaluate(x, y, z, s);
  return s;
}

void write(cv::Mat* picture, const std::string& text, cv::Point at, double size = 0.5) {
  cv::putText(*picture, text, at, cv::FONT_HERSHEY_SIMPLEX, size, kInk, 1, cv::LINE_AA);
}

/// The depth frame in grey, near is light, pixels without a return are black; over it s in the opening's plane, within
/// kOverlay_m of the centre, where the ray of a pixel meets that plane.
cv::Mat draw_depth(const cv::Mat& depth_mm, const config::SavedFrame& frame, const planner::Field& field,
                   const Eigen::Isometry3d& X_WG) {
  const CameraModel& camera = frame.camera;
  cv::Mat picture(depth_mm.rows * kScale, depth_mm.cols * kScale, CV_8UC3, cv::Scalar(0, 0, 0));
  std::vector<Eigen::Vector3d> points_W;
  std::vector<cv::Point> pixels;
  for (int row = 0; row < picture.rows; ++row)
    for (int column = 0; column < picture.cols; ++column) {
      if (const auto mm = depth_mm.at<std::uint16_t>(row / kScale, column / kScale); mm != 0) {
        const auto level = cv::saturate_cast<uchar>(240.0 - 190.0 * mm * 1e-3 / camera.max_depth_m);
        picture.at<cv::Vec3b>(row, column) = {level, level, level};
      }
      const Eigen::Vector3d ray_C(((column + 0.5) / kScale - camera.cx_px) / camera.fx_px,
                                  ((row + 0.5) / kScale - camera.cy_px) / camera.fy_px, 1.0);
      const Eigen::Vector3d ray_W = frame.X_WC.linear() * ray_C;
      const Eigen::Vector3d normal_W = X_WG.linear().col(0);
      const double toward = normal_W.dot(ray_W);
      if (std::abs(toward) < 1e-6) continue;
      const double depth_m = normal_W.dot(X_WG.translation() - frame.X_WC.translation()) / toward;
      const Eigen::Vector3d p_W = frame.X_WC.translation() + depth_m * ray_W;
      if (depth_m < 0.05 || (p_W - X_WG.translation()).cwiseAbs().maxCoeff() > kOverlay_m) continue;
      points_W.push_back(p_W);
      pixels.emplace_back(column, row);
    }
  const std::vector<float> s = evaluate(field, points_W);
  for (std::size_t i = 0; i < s.size(); ++i) {
    cv::Vec3b& pixel = picture.at<cv::Vec3b>(pixels[i]);
    const cv::Vec3b color = field_color(s[i]);
    for (int channel = 0; channel < 3; ++channel)
      pixel[channel] = static_cast<uchar>((pixel[channel] + 2 * color[channel]) / 3);
  }
  return picture;
}

/// Outline of a square of half-width `half_m` in the gate's plane, as the camera sees it.
void draw_outline(cv::Mat* picture, const config::SavedFrame& frame, const Eigen::Isometry3d& X_WG, double half_m,
                  const cv::Scalar& color) {
  std::vector<cv::Point> corners;
  for (const auto& [y, z] : {std::pair{1, 1}, {1, -1}, {-1, -1}, {-1, 1}}) {
    const Eigen::Vector3d p_C = frame.X_WC.inverse() * (X_WG * Eigen::Vector3d(0, y * half_m, z * half_m));
    if (p_C.z() < 0.05) return;
    corners.emplace_back(cvRound(kScale * (frame.camera.fx_px * p_C.x() / p_C.z() + frame.camera.cx_px)),
                         cvRound(kScale * (frame.camera.fy_px * p_C.y() / p_C.z() + frame.camera.cy_px)));
  }
  cv::polylines(*picture, corners, true, color, 2, cv::LINE_AA);
}

/// Seen from above at one height: s around the centre, the zero line in black, the true gate (when it is known) as a
/// bar.
cv::Mat draw_map(const planner::Field& field, const config::SavedFrame& frame, const Eigen::Isometry3d& X_WG,
                 double height_m) {
  cv::Mat map(kMapSize_px, kMapSize_px, CV_8UC3);
  const Eigen::Vector3d center = X_WG.translation();
  const double metre_px = kMapSize_px / (2.0 * kMapHalf_m);
  std::vector<Eigen::Vector3d> points_W;
  for (int row = 0; row < kMapSize_px; ++row)
    for (int column = 0; column < kMapSize_px; ++column)
      points_W.emplace_back(center + Eigen::Vector3d((column + 0.5) / metre_px - kMapHalf_m,
                                                     kMapHalf_m - (row + 0.5) / metre_px, height_m));
  const std::vector<float> s = evaluate(field, points_W);
  const auto at = [&s](int row, int column) { return s[static_cast<std::size_t>(row * kMapSize_px + column)]; };
  for (int row = 0; row < kMapSize_px; ++row)
    for (int column = 0; column < kMapSize_px; ++column) {
      const bool edge =
          row > 0 && column > 0 &&
          ((at(row, column) > 0) != (at(row - 1, column) > 0) || (at(row, column) > 0) != (at(row, column - 1) > 0));
      map.at<cv::Vec3b>(row, column) = edge ? cv::Vec3b(0, 0, 0) : field_color(at(row, column));
    }
  const auto to_map = [&](const Eigen::Vector3d& p_W) {
    return cv::Point(cvRound((p_W.x() - center.x() + kMapHalf_m) * metre_px),
                     cvRound((kMapHalf_m - p_W.y() + center.y()) * metre_px));
  };
  if (frame.gate) {
    const GateShape& shape = frame.gate->shape;
    for (const double side : {-1.0, 1.0})
      cv::line(map, to_map(frame.gate->X_WG * Eigen::Vector3d(0, side * shape.inner_half_m, 0)),
               to_map(frame.gate->X_WG * Eigen::Vector3d(0, side * shape.outer_half_m, 0)), kTruth, 5, cv::LINE_AA);
  }
  const cv::Point eye = to_map(frame.X_WC.translation());
  if (cv::Rect(0, 0, kMapSize_px, kMapSize_px).contains(eye)) cv::circle(map, eye, 5, kInk, cv::FILLED, cv::LINE_AA);
  return map;
}

int run(const std::filesystem::path& frame_file, const std::filesystem::path& model_folder,
        const std::filesystem::path& output) {
  const auto fail = [](const std::string& what) {
    std::cerr << "gatefield-slice: " << what << '\n';
    return 2;
  };
  const auto bundle = model::Bundle::read(model_folder);
  if (!bundle) return fail(bundle.error());
  const auto frame = config::load_frame(frame_file);
  if (!frame) return fail(frame.error());
  const cv::Mat depth_mm = cv::imread(frame->depth_file.string(), cv::IMREAD_UNCHANGED);
  if (depth_mm.empty() || depth_mm.type() != CV_16UC1 || depth_mm.cols != frame->camera.width_px ||
      depth_mm.rows != frame->camera.height_px)
    return fail(frame->depth_file.string() + " is no 16-bit grey image of " + std::to_string(frame->camera.width_px) +
                " x " + std::to_string(frame->camera.height_px) + " pixels");
  auto encoder = perception::DepthEncoder::create(*bundle);
  if (!encoder) return fail(encoder.error());

  std::vector<float> depth_m;
  for (int row = 0; row < depth_mm.rows; ++row)
    for (int column = 0; column < depth_mm.cols; ++column)
      depth_m.push_back(1e-3f * static_cast<float>(depth_mm.at<std::uint16_t>(row, column)));
  const auto encoding = encoder.value()->encode(depth_m, frame->camera, std::nullopt);
  if (!encoding) return fail("the network finds nothing to look at in " + frame->depth_file.string());

  perception::DecodedField field;
  kernels::fold(bundle->decoder(), encoding->latent, frame->X_WC, &field.decoder);
  GateShape shape;
  shape.inner_half_m = bundle->manifest().gate_inner_half_m;
  shape.outer_half_m = std::max(shape.outer_half_m, 1.2 * shape.inner_half_m);
  const Eigen::Vector3d around_W = frame->X_WC * encoding->center_C.cast<double>();
  const Eigen::Vector3d forward_W = frame->X_WC.linear().col(2);
  const auto fit = perception::fit_hourglass(field, shape, bundle->manifest().cone_angle_rad, around_W, forward_W);
  if (!fit.ok) return fail("no hourglass fits the field of " + frame->depth_file.string());

  cv::Mat depth = draw_depth(depth_mm, *frame, field, fit.X_WG);
  draw_outline(&depth, *frame, fit.X_WG, shape.inner_half_m, kInk);
  if (frame->gate) {
    draw_outline(&depth, *frame, frame->gate->X_WG, frame->gate->shape.inner_half_m, kTruth);
    draw_outline(&depth, *frame, frame->gate->X_WG, frame->gate->shape.outer_half_m, kTruth);
  }

  const int width = std::max(depth.cols, 3 * kMapSize_px + 2 * kBorder_px) + 2 * kBorder_px;
  cv::Mat picture(depth.rows + kMapSize_px + 3 * kBorder_px + 2 * kCaption_px, width, CV_8UC3, kPaper);
  std::string title = "depth frame, Gate-SDF in the opening's plane (green: through, red: not); validity " +
                      cv::format("%.2f", encoding->validity);
  if (frame->gate)
    title += cv::format(", centre off by %.3f m", (fit.X_WG.translation() - frame->gate->X_WG.translation()).norm());
  write(&picture, title, {kBorder_px, kBorder_px + 8});
  depth.copyTo(picture(cv::Rect(kBorder_px, kCaption_px + 8, depth.cols, depth.rows)));
  int left = kBorder_px;
  const int top = depth.rows + 2 * kCaption_px + kBorder_px;
  for (const double height_m : kHeights_m) {
    write(&picture, cv::format("from above, %+.1f m, 5 x 5 m", height_m), {left, top - 8}, 0.42);
    draw_map(field, *frame, fit.X_WG, height_m).copyTo(picture(cv::Rect(left, top, kMapSize_px, kMapSize_px)));
    left += kMapSize_px + kBorder_px;
  }
  write(
      &picture,
      frame->gate ? "black: learned (zero line, opening), blue: the true gate" : "black: learned (zero line, opening)",
      {kBorder_px, picture.rows - 4}, 0.42);

  bool written = false;
  try {
    written = cv::imwrite(output.string(), picture);
  } catch (const cv::Exception&) {
  }
  if (!written)
    return fail(output.string() + " can't be written, expected a path that ends in .png in a folder that exists");
  std::cout << "centre " << fit.X_WG.translation().transpose() << " m, axis " << fit.X_WG.linear().col(0).transpose()
            << ", rms " << fit.rms_m << " m, validity " << encoding->validity << "; picture in " << output.string()
            << '\n';
  return 0;
}

}  // namespace
}  // namespace gatefield

int main(int argc, char** argv) {
  CLI::App app{
      "Draws what a model's field says over the depth frame that it comes from.\n"
      "Example: gatefield-slice --frame out/frame/frame.txt --model deploy/models/race --output slice.png"};
  std::string frame, model_folder = "deploy/models/race", output = "slice.png";
  app.add_option("--frame", frame, "frame.txt as gatefield-sim --save-frame writes it")->required();
  app.add_option("--model", model_folder, "model bundle (a folder with manifest.txt)")->capture_default_str();
  app.add_option("--output", output, "picture to write (.png)")->capture_default_str();
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  return gatefield::run(frame, model_folder, output);
}
