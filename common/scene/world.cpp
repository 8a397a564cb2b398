#include "common/scene/world.h"

#include <cmath>
#include <numbers>

namespace gatefield::scene {
namespace {

Box piece(const Gate& gate, const Eigen::Isometry3d& X_GO, const Eigen::Vector3d& half_m) {
  return {.X_WO = gate.X_WG * X_GO, .half_m = half_m, .reflectance = gate.reflectance};
}

}  // namespace

std::vector<Box> frame_boxes(const Gate& gate) {
  const double inner_m = gate.shape.inner_half_m;
  const double outer_m = gate.shape.outer_half_m;
  const double half_thickness_m = 0.5 * gate.shape.thickness_m;
  const double middle_m = 0.5 * (inner_m + outer_m);
  const double half_width_m = 0.5 * (outer_m - inner_m);

  std::vector<Box> boxes;
  if (gate.shape.opening == GateShape::Opening::kSquare) {
    // Top and bottom run over the whole width, the posts stand between them: no corner belongs to two boxes.
    for (const double side : {1.0, -1.0}) {
      boxes.push_back(piece(gate, Eigen::Isometry3d(Eigen::Translation3d(0, 0, side * middle_m)),
                            {half_thickness_m, outer_m, half_width_m}));
      boxes.push_back(piece(gate, Eigen::Isometry3d(Eigen::Translation3d(0, side * middle_m, 0)),
                            {half_thickness_m, half_width_m, inner_m}));
    }
    return boxes;
  }

  // Sides of a 16-gon whose inner edges touch the opening's circle from outside, so that nothing reaches into the
  // opening; each as long as the outer edge needs, so that the ring has no gaps (neighbours overlap a little at the
  // inner edge).
  constexpr int kSides = 16;
  const double half_length_m = outer_m * std::tan(std::numbers::pi / kSides);
  for (int side = 0; side < kSides; ++side) {
    const Eigen::AngleAxisd turn(2.0 * std::numbers::pi * side / kSides, Eigen::Vector3d::UnitX());
    boxes.push_back(
        piece(gate, turn * Eigen::Translation3d(0, middle_m, 0), {half_thickness_m, half_width_m, half_length_m}));
  }
  return boxes;
}

std::vector<Box> leg_boxes(const Gate& gate, double width_m, double floor_z_m) {
  const bool round = gate.shape.opening == GateShape::Opening::kRound;
  const double corner_m = gate.shape.outer_half_m * (round ? std::sqrt(0.5) : 1.0);
  const Eigen::Vector3d left_W = gate.X_WG.linear().col(1);
  std::vector<Box> boxes;
  for (const double side : {1.0, -1.0}) {
    const Eigen::Vector3d top_W = gate.X_WG * Eigen::Vector3d(0, side * (corner_m - 0.5 * width_m), -corner_m);
    const double height_m = top_W.z() - floor_z_m;
    if (height_m < 0.01) continue;
    Box leg{.reflectance = gate.reflectance};
    leg.X_WO.linear() =
        Eigen::AngleAxisd(std::atan2(-left_W.x(), left_W.y()), Eigen::Vector3d::UnitZ()).toRotationMatrix();
    leg.X_WO.translation() = top_W - Eigen::Vector3d(0, 0, 0.5 * height_m);
    leg.half_m = {0.5 * gate.shape.thickness_m, 0.5 * width_m, 0.5 * height_m};
    boxes.push_back(leg);
  }
  return boxes;
}

std::vector<Box> solid_boxes(const World& world) {
  std::vector<Box> boxes = world.boxes;
  for (const Gate& gate : world.gates) {
    const std::vector<Box> frame = frame_boxes(gate);
    boxes.insert(boxes.end(), frame.begin(), frame.end());
  }
  return boxes;
}

}  // namespace gatefield::scene
