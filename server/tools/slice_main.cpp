// gatefield-slice: what the learned field says, drawn over the depth frame that it comes from.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <iostream>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <vector>

#include "common/config/frame.h"
#include "common/model/bundle.h"
#include "server/kernels/backend.h"
#include "server/perception/learned/decoded_field.h"
#include "server/perception/learned/depth_encoder.h"
#include "server/perception/learned/hourglass_fit.h"
#include "server/tools/field_picture.h"

namespace gatefield {
namespace {

constexpr int kMapSize_px = 300;    ///< one top-down map
constexpr double kOverlay_m = 1.3;  ///< half-width of the slice that is laid over the depth image
constexpr double kHeights_m[] = {0.4, 0.0, -0.4};
constexpr int kBorder_px = 16;
constexpr int kCaption_px = 26;
const cv::Scalar kPaper(255, 255, 255);

/// Seen from above at one height: s around the centre, the zero line in black, the true gate (when it is known) as
/// bars.
cv::Mat map_at(const gates::Field& field, const config::SavedFrame& frame, const Eigen::Vector3d& center_W,
               double height_m) {
  tools::MapPlane plane;
  plane.X_WM.translation() = center_W + Eigen::Vector3d(0, 0, height_m);
  plane.size_px = kMapSize_px;
  const std::vector<float> values = tools::map_values(plane, field);
  cv::Mat map = tools::draw_map(plane, values);
  tools::draw_zero_line(&map, plane, values, cv::Scalar(0, 0, 0));
  if (frame.gate) tools::draw_posts(&map, plane, frame.gate->shape, frame.gate->X_WG);
  tools::draw_eye(&map, plane, frame.X_WC.translation());
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
  kernels::fold(kernels::best_backend().prepare(bundle->decoder()), encoding->latent, frame->X_WC, &field.decoder);
  GateShape shape;
  shape.inner_half_m = bundle->manifest().gate_inner_half_m;
  shape.outer_half_m = std::max(shape.outer_half_m, 1.2 * shape.inner_half_m);
  if (frame->gate) shape.opening = frame->gate->shape.opening;  // which kind it is, the planner knows as well
  const Eigen::Vector3d around_W = frame->X_WC * encoding->center_C.cast<double>();
  const Eigen::Vector3d forward_W = frame->X_WC.linear().col(2);
  const auto fit = perception::fit_hourglass(field, shape, bundle->manifest().cone_angle_rad, around_W, forward_W);
  if (!fit.ok) return fail("no hourglass fits the field of " + frame->depth_file.string());

  const tools::View view{frame->camera, frame->X_WC};
  cv::Mat depth = tools::draw_depth(view, depth_m);
  tools::draw_field_over(&depth, view, field, fit.X_WG, kOverlay_m);
  tools::draw_outline(&depth, view, fit.X_WG, shape.inner_half_m, tools::kInk, shape.opening);
  if (frame->gate) {
    tools::draw_outline(&depth, view, frame->gate->X_WG, frame->gate->shape.inner_half_m, tools::kTruth, shape.opening);
    tools::draw_outline(&depth, view, frame->gate->X_WG, frame->gate->shape.outer_half_m, tools::kTruth, shape.opening);
  }

  const int width = std::max(depth.cols, 3 * kMapSize_px + 2 * kBorder_px) + 2 * kBorder_px;
  cv::Mat picture(depth.rows + kMapSize_px + 3 * kBorder_px + 2 * kCaption_px, width, CV_8UC3, kPaper);
  std::string title = "depth frame, Gate-SDF in the opening's plane (green: through, red: not); validity " +
                      cv::format("%.2f", encoding->validity);
  if (frame->gate)
    title += cv::format(", centre off by %.3f m", (fit.X_WG.translation() - frame->gate->X_WG.translation()).norm());
  tools::write(&picture, title, {kBorder_px, kBorder_px + 8});
  depth.copyTo(picture(cv::Rect(kBorder_px, kCaption_px + 8, depth.cols, depth.rows)));
  int left = kBorder_px;
  const int top = depth.rows + 2 * kCaption_px + kBorder_px;
  for (const double height_m : kHeights_m) {
    tools::write(&picture, cv::format("from above, %+.1f m, 5 x 5 m", height_m), {left, top - 8}, 0.42);
    map_at(field, *frame, fit.X_WG.translation(), height_m)
        .copyTo(picture(cv::Rect(left, top, kMapSize_px, kMapSize_px)));
    left += kMapSize_px + kBorder_px;
  }
  tools::write(
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
