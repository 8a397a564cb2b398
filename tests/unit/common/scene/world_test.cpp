#include "common/scene/world.h"

#include <gtest/gtest.h>

#include "common/base/random.h"

namespace gatefield::scene {
namespace {

/// How many boxes hold the point.
int holding(const std::vector<Box>& boxes, const Eigen::Vector3d& p_W) {
  int count = 0;
  for (const Box& box : boxes) {
    const Eigen::Vector3d p_O = box.X_WO.inverse() * p_W;
    if ((p_O.cwiseAbs() - box.half_m).maxCoeff() < 0.0) ++count;
  }
  return count;
}

Gate tilted_gate(GateShape::Opening opening) {
  Gate gate;
  gate.shape.opening = opening;
  gate.X_WG.linear() =
      (Eigen::AngleAxisd(0.7, Eigen::Vector3d::UnitZ()) * Eigen::AngleAxisd(-0.3, Eigen::Vector3d::UnitY()) *
       Eigen::AngleAxisd(0.2, Eigen::Vector3d::UnitX()))
          .toRotationMatrix();
  gate.X_WG.translation() = Eigen::Vector3d(3, -2, 1.5);
  gate.reflectance = 0.3f;
  return gate;
}

TEST(FrameBoxes, SquareFrameIsTiledExactlyOnce) {
  const Gate gate = tilted_gate(GateShape::Opening::kSquare);
  const std::vector<Box> boxes = frame_boxes(gate);
  ASSERT_EQ(boxes.size(), 4u);
  Random random(1);
  int in_frame = 0;
  for (int i = 0; i < 20'000; ++i) {
    const Eigen::Vector3d p_G(random.uniform(-0.06, 0.06), random.uniform(-0.9, 0.9), random.uniform(-0.9, 0.9));
    const double transverse_m = transverse_distance(gate.shape, p_G);
    const bool in_solid = std::abs(p_G.x()) < 0.5 * gate.shape.thickness_m && transverse_m > gate.shape.inner_half_m &&
                          transverse_m < gate.shape.outer_half_m;
    in_frame += in_solid ? 1 : 0;
    EXPECT_EQ(holding(boxes, gate.X_WG * p_G), in_solid ? 1 : 0) << p_G.transpose();
  }
  EXPECT_GT(in_frame, 1000);
}

TEST(FrameBoxes, SquareFrameHasTheFramesVolume) {
  const Gate gate = tilted_gate(GateShape::Opening::kSquare);
  double volume_m3 = 0.0;
  for (const Box& box : frame_boxes(gate)) volume_m3 += 8.0 * box.half_m.prod();
  EXPECT_NEAR(volume_m3, 4.0 * (0.75 * 0.75 - 0.5 * 0.5) * 0.06, 1e-12);
}

TEST(FrameBoxes, RoundFrameClosesTheRingAndLeavesTheOpeningFree) {
  const Gate gate = tilted_gate(GateShape::Opening::kRound);
  const std::vector<Box> boxes = frame_boxes(gate);
  ASSERT_EQ(boxes.size(), 16u);
  // Sixteen straight sides: the inner edge lies at most inner / cos(pi / 16) = 1.02 inner away, the outer one at least
  // at outer.
  Random random(2);
  for (int i = 0; i < 20'000; ++i) {
    const Eigen::Vector3d p_G(random.uniform(-0.029, 0.029), random.uniform(-0.9, 0.9), random.uniform(-0.9, 0.9));
    const double radius_m = transverse_distance(gate.shape, p_G);
    const int count = holding(boxes, gate.X_WG * p_G);
    if (radius_m < 0.5) {
      EXPECT_EQ(count, 0) << p_G.transpose();
    } else if (radius_m > 0.5 * 1.02 && radius_m < 0.75) {
      EXPECT_GE(count, 1) << p_G.transpose();
    }
  }
}

TEST(LegBoxes, StandUprightUnderTheLowerCornersDownToTheFloor) {
  Gate gate;
  gate.X_WG.translation() = Eigen::Vector3d(3, -2, 1.5);
  gate.X_WG.linear() = Eigen::AngleAxisd(0.4, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  const std::vector<Box> legs = leg_boxes(gate, 0.05, 0.2);
  ASSERT_EQ(legs.size(), 2u);
  const double middle_m = gate.shape.outer_half_m - 0.025;
  for (const double side : {1.0, -1.0}) {
    const auto at = [&](double x, double y, double up_m) {
      Eigen::Vector3d p_W = gate.X_WG * Eigen::Vector3d(x, y, 0);
      p_W.z() = up_m;
      return holding(legs, p_W);
    };
    EXPECT_EQ(at(0, side * middle_m, 0.21), 1);
    EXPECT_EQ(at(0.029, side * (middle_m + 0.024), 1.5 - gate.shape.outer_half_m - 0.01), 1);
    EXPECT_EQ(at(0, side * middle_m, 1.5 - gate.shape.outer_half_m + 0.01), 0) << "the frame begins";
    EXPECT_EQ(at(0, side * middle_m, 0.19), 0) << "below the floor";
    EXPECT_EQ(at(0, side * (middle_m - 0.03), 0.5), 0) << "between the legs";
  }
  EXPECT_TRUE(leg_boxes(gate, 0.05, 1.5 - gate.shape.outer_half_m).empty());
}

TEST(FrameBoxes, CarryTheGatesReflectance) {
  for (const auto opening : {GateShape::Opening::kSquare, GateShape::Opening::kRound}) {
    for (const Box& box : frame_boxes(tilted_gate(opening))) EXPECT_FLOAT_EQ(box.reflectance, 0.3f);
  }
}

TEST(PassedGates, AgainstTheirAxisAreTurnedHalfAndStandWhereTheyStand) {
  World world;
  world.gates = {tilted_gate(GateShape::Opening::kSquare), tilted_gate(GateShape::Opening::kRound)};
  const Gate along = as_passed(world, {1, true}), against = as_passed(world, {1, false});
  EXPECT_EQ(along.X_WG.matrix(), world.gates[1].X_WG.matrix());
  EXPECT_EQ(against.X_WG.translation(), along.X_WG.translation());
  EXPECT_EQ(against.X_WG.linear().col(0), -along.X_WG.linear().col(0));
  EXPECT_EQ(against.X_WG.linear().col(2), along.X_WG.linear().col(2));
  EXPECT_NEAR(against.X_WG.linear().determinant(), 1.0, 1e-12);
  EXPECT_EQ(against.shape.opening, along.shape.opening);
}

}  // namespace
}  // namespace gatefield::scene
