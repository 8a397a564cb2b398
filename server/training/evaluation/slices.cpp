#include "server/training/evaluation/slices.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "common/scene/depth_camera.h"
#include "server/gates/analytic_field.h"
#include "server/tools/field_picture.h"
#include "server/training/data/scene_parts.h"
#include "server/training/evaluation/held_out.h"

namespace gatefield::training {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr int kScale = 3;
constexpr int kMap_px = 224;
constexpr double kMapHalf_m = 2.0;
constexpr int kGap_px = 12;
constexpr int kCaption_px = 22;
constexpr double kOverlay_m = 1.2;
const cv::Scalar kLearned(0, 0, 0);

/// What the network makes of one image, in the world that the image was taken in.
struct Reading {
  bool encoded = false;
  double validity = 0.0;
  std::optional<double> center_m, normal_deg;
  perception::DecodedField field;
};

Reading read(Observer* observer, const std::vector<float>& image_m, const Isometry3d& X_WC, const Isometry3d& X_WG,
             const GateShape& shape, const std::optional<Vector3d>& prior_C) {
  Reading out;
  const auto encoding = observer->encode(image_m, prior_C);
  if (!encoding) return out;
  out.encoded = true;
  out.validity = encoding->validity;
  const Isometry3d X_CG = X_WC.inverse() * X_WG;
  if (const auto pose = observer->fit(*encoding, shape, prior_C.value_or(X_CG.translation())); pose.has_value()) {
    out.center_m = (pose->center_C - X_CG.translation()).norm();
    const double cosine = std::abs(pose->axis_C.dot(X_CG.linear().col(0)));
    out.normal_deg = std::acos(std::min(1.0, cosine)) / kDegree;
  }
  kernels::fold(observer->decoder(), encoding->latent, X_WC, &out.field.decoder);
  return out;
}

std::string words(const Reading& reading) {
  if (!reading.encoded) return "nothing to look at";
  std::string out = cv::format("validity %.2f, ", reading.validity);
  if (!reading.center_m) return out + "the field shows no gate";
  return out + cv::format("centre off by %.3f m, normal by %.1f deg", *reading.center_m, *reading.normal_deg);
}

/// A level cut through the gate, the way into it to the top of the picture, seen from the camera's side.
tools::MapPlane cut(const Isometry3d& X_WG, const Vector3d& p_WC, double height_m, int size_px) {
  Vector3d into_W = X_WG.linear().col(0);
  if (into_W.dot(X_WG.translation() - p_WC) < 0.0) into_W = -into_W;
  const Vector3d up_W = X_WG.linear().col(2);
  tools::MapPlane plane;
  plane.X_WM.linear() << into_W.cross(up_W), into_W, up_W;
  plane.X_WM.translation() = X_WG.translation() + height_m * up_W;
  plane.half_m = kMapHalf_m;
  plane.size_px = size_px;
  return plane;
}

cv::Mat map_of(const Reading& reading, const GateShape& shape, const Isometry3d& X_WG, const Vector3d& p_WC,
               double height_m, int size_px) {
  const tools::MapPlane plane = cut(X_WG, p_WC, height_m, size_px);
  if (!reading.encoded) return {plane.size_px, plane.size_px, CV_8UC3, cv::Scalar(200, 200, 200)};
  const std::vector<float> values = tools::map_values(plane, reading.field);
  cv::Mat map = tools::draw_map(plane, values);
  tools::draw_zero_line(&map, plane, tools::map_values(plane, gates::AnalyticField(X_WG, shape)), tools::kTruth);
  tools::draw_zero_line(&map, plane, values, kLearned);
  tools::draw_posts(&map, plane, shape, X_WG);
  tools::draw_eye(&map, plane, p_WC);
  return map;
}

cv::Mat depth_of(const std::vector<float>& image_m, const Isometry3d& X_WC, const Isometry3d& X_WG,
                 const GateShape& shape, const Reading* overlay) {
  const tools::View view{dataset_camera(), X_WC, kScale};
  cv::Mat picture = tools::draw_depth(view, image_m);
  if (overlay != nullptr && overlay->encoded) tools::draw_field_over(&picture, view, overlay->field, X_WG, kOverlay_m);
  tools::draw_outline(&picture, view, X_WG, shape.inner_half_m, tools::kTruth, shape.opening);
  tools::draw_outline(&picture, view, X_WG, shape.outer_half_m, tools::kTruth, shape.opening);
  return picture;
}

void put(const cv::Mat& piece, cv::Mat* picture, int left, int top) {
  piece.copyTo((*picture)(cv::Rect(left, top, piece.cols, piece.rows)));
}

cv::Mat paper(int width_px, int height_px) { return {height_px, width_px, CV_8UC3, cv::Scalar(255, 255, 255)}; }

Status save(const cv::Mat& picture, const std::filesystem::path& png) {
  bool written = false;
  try {
    written = cv::imwrite(png.string(), picture);
  } catch (const cv::Exception&) {
  }
  if (!written)
    return Error{png.string() + " can't be written, expected a path that ends in .png in a folder there is"};
  return {};
}

/// One way to make a gate hard to see.
struct Condition {
  const char* name;
  double noise_scale = 1.0;
  double turned_deg = 0.0;  ///< the camera looks this far past the gate
  bool pole = false, second_gate = false, holes = false;
};
constexpr Condition kConditions[] = {
    {"clean", 0.0},
    {"sensor noise"},
    {"about half of the gate outside of the image", 1.0, 40.0},
    {"a pole before the gate", 1.0, 0.0, true},
    {"another gate's post in the line of sight", 1.0, 0.0, false, true},
    {"large holes and speckle", 1.0, 0.0, false, false, true},
};

/// The gate stands in the origin of a hall, the camera 3 m before it, 25 deg off its axis.
scene::World hall(const Condition& condition, const Vector3d& p_WC) {
  scene::World world;
  world.has_floor = true;
  world.floor_z_m = -1.3;
  world.gates.emplace_back();
  const auto wall = [&](double x, double y, double half_x, double half_y) {
    world.boxes.push_back({.X_WO = pose({x, y, 0.7}, 0, 0, 0), .half_m = {half_x, half_y, 2.0}, .reflectance = 0.8f});
  };
  wall(6.0, 0.0, 0.1, 8.0);
  wall(-2.0, 5.0, 8.0, 0.1);
  wall(-2.0, -5.0, 8.0, 0.1);
  world.boxes.push_back({.X_WO = pose({2.5, -2.2, -0.9}, 0.4, 0, 0), .half_m = {0.4, 0.5, 0.4}});
  for (const double side : {-0.6, 0.6})
    world.boxes.push_back({.X_WO = pose({0, side, -1.0}, 0, 0, 0), .half_m = {0.03, 0.03, 0.3}});
  if (condition.pole)
    world.boxes.push_back(
        {.X_WO = pose(0.45 * p_WC + Vector3d(0.0, -0.06, 0.0), 0, 0, 0), .half_m = {0.05, 0.05, 1.3}});
  if (condition.second_gate) {
    world.gates.emplace_back();
    world.gates.back().X_WG = pose({-1.3, 0.2, 0.05}, 0.35, 0, 0);
  }
  return world;
}

}  // namespace

Status draw_occlusions(Observer* observer, std::uint64_t seed, const std::filesystem::path& png) {
  const double bearing = 25.0 * kDegree;
  const Vector3d p_WC(-3.0 * std::cos(bearing), -3.0 * std::sin(bearing), 0.25);
  const int block_width = kImageWidth_px * kScale;
  const int maps_width = 3 * kMap_px + 2 * kGap_px;
  const int column = std::max(block_width, maps_width);
  const int block_height = 2 * kCaption_px + kImageHeight_px * kScale + kGap_px + kCaption_px + kMap_px + 2 * kGap_px;
  cv::Mat picture = paper(3 * column + 4 * 2 * kGap_px, 2 * block_height + 2 * kGap_px + kCaption_px);
  int index = 0;
  for (const Condition& condition : kConditions) {
    const scene::World world = hall(condition, p_WC);
    const Isometry3d& X_WG = world.gates[0].X_WG;
    const double yaw = std::atan2(-p_WC.y(), -p_WC.x()) + condition.turned_deg * kDegree;
    Isometry3d X_WC = pose(p_WC, yaw, 20.0 * kDegree, 6.0 * kDegree);
    X_WC.linear() = X_WC.linear() * dataset_camera().X_BC.linear();
    scene::SensorNoise noise;
    noise.scale = condition.noise_scale;
    if (condition.holes) {
      noise.hole_rate_per_image = 25.0;
      noise.hole_radius_px = 6.0;
      noise.speckle_probability = 0.04;
    }
    Random random(seed, static_cast<std::uint64_t>(index));
    scene::DepthImage clean, noisy;
    scene::SurfaceImage surface;
    scene::DepthCamera(world).render(dataset_camera(), X_WC, &clean, &surface);
    scene::apply_noise(noise, dataset_camera(), clean, surface, &random, &noisy);

    const GateShape& shape = world.gates[0].shape;
    std::optional<Vector3d> prior_C;
    if (condition.second_gate) prior_C = Vector3d(X_WC.inverse() * (X_WG.translation() + Vector3d(0.1, -0.1, 0.1)));
    const Reading reading = read(observer, noisy.depth_m, X_WC, X_WG, shape, prior_C);
    const int left = 2 * kGap_px + (index % 3) * (column + 2 * kGap_px);
    int top = kGap_px + (index / 3) * block_height;
    tools::write(&picture, std::string(condition.name) + (prior_C ? " (prior: the true centre + 0.17 m)" : ""),
                 {left, top + 14});
    tools::write(&picture, words(reading), {left, top + kCaption_px + 12}, 0.42);
    top += 2 * kCaption_px;
    put(depth_of(noisy.depth_m, X_WC, X_WG, shape, &reading), &picture, left + (column - block_width) / 2, top);
    top += kImageHeight_px * kScale + kGap_px + kCaption_px;
    int map = 0;
    for (const auto& [name, height_m] : {std::pair{"bottom", -0.45}, {"middle", 0.0}, {"top", 0.45}}) {
      const int x = left + map++ * (kMap_px + kGap_px);
      tools::write(&picture, cv::format("%s, %+.2f m", name, height_m), {x, top - 6}, 0.42);
      put(map_of(reading, shape, X_WG, p_WC, height_m, kMap_px), &picture, x, top);
    }
    ++index;
  }
  tools::write(&picture,
               "Green: inside the learned Gate-SDF, red: outside (full colour at 1 m). Black: its zero line. Blue: the "
               "true zero line, gate and posts. Maps: 4 x 4 m seen from above, flight upwards; dot: camera.",
               {2 * kGap_px, picture.rows - kGap_px}, 0.46);
  return save(picture, png);
}

Status draw_side_by_side(const std::vector<NamedObserver>& observers, const Dataset& dataset, int frames,
                         std::uint64_t seed, const std::filesystem::path& png) {
  std::vector<std::uint64_t> fitting;
  for (std::uint64_t i = 0; i < dataset.size(); ++i) {
    const SampleView sample = dataset.at(i);
    if (sample.valid_count != 1 || sample.gates[0].visible_fraction < 0.5f) continue;
    const float distance_m = sample.gates[0].p_CG.norm();
    if (distance_m >= 1.5f && distance_m < 6.0f) fitting.push_back(i);
  }
  if (fitting.empty()) return Error{"no frame of the set shows one gate, half visible, 1.5 to 6 m away"};
  const auto rows = std::min(fitting.size(), static_cast<std::size_t>(std::max(1, frames)));
  const int depth_width = kImageWidth_px * kScale;
  const int map_px = kImageHeight_px * kScale;  // as high as the depth image
  const int row_height = map_px + kCaption_px + kGap_px;
  cv::Mat picture = paper(depth_width + 3 * kGap_px + static_cast<int>(observers.size()) * (map_px + kGap_px),
                          static_cast<int>(rows) * row_height + 2 * kCaption_px + kGap_px);
  // The fit turns its starting poses about the vertical: a camera that looks level.
  const Isometry3d X_WC = forward_camera_mount(0.0);
  for (std::size_t row = 0; row < rows; ++row) {
    const SampleView sample = dataset.at(fitting[(2 * row + 1) * fitting.size() / (2 * rows)]);
    const GateLabel& gate = sample.gates[0];
    const Isometry3d X_WG = X_WC * gate.X_CG().cast<double>();
    std::vector<float> image_m(kImageSize_px);
    Random random(seed, row);
    draw_noisy(sample, {}, &random, image_m);
    const GateFacts facts = facts_of(gate, 1);
    int left = kGap_px;
    const int top = kCaption_px + static_cast<int>(row) * row_height;
    tools::write(&picture,
                 cv::format("%.1f m, %.0f deg off the axis, %.0f %% visible", facts.distance_m, facts.axis_deg,
                            100.0 * facts.visible_fraction),
                 {left, top - 6}, 0.42);
    put(depth_of(image_m, X_WC, X_WG, gate.shape, nullptr), &picture, left, top);
    left += depth_width + kGap_px;
    for (const NamedObserver& one : observers) {
      const Reading reading = read(one.observer, image_m, X_WC, X_WG, gate.shape, std::nullopt);
      tools::write(
          &picture,
          one.name + (reading.center_m ? cv::format(": %.3f m, %.1f deg", *reading.center_m, *reading.normal_deg)
                                       : std::string(": no gate")),
          {left, top - 6}, 0.42);
      put(map_of(reading, gate.shape, X_WG, X_WC.translation(), 0.0, map_px), &picture, left, top);
      left += map_px + kGap_px;
    }
  }
  tools::write(
      &picture,
      "Maps: 4 x 4 m from above in the middle of the opening, flight upwards. Black: the learned zero line, blue: "
      "the true one and the posts. First look, no prior.",
      {kGap_px, picture.rows - kGap_px}, 0.42);
  return save(picture, png);
}

}  // namespace gatefield::training
