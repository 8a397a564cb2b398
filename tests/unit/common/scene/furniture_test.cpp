#include "common/scene/furniture.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace gatefield::scene {
namespace {

Hall hall() {
  Hall hall;
  hall.room = {Eigen::Vector3d(-10, -8, 0.5), Eigen::Vector3d(10, 8, 4.5)};
  for (int i = 0; i <= 100; ++i) hall.way_W.emplace_back(-9.0 + 0.18 * i, 0.0, 2.0);
  return hall;
}

TEST(Furniture, WallsStandAroundTheRoom) {
  const Hall room = hall();
  Random random(1);
  const auto boxes = furnish(room, &random);
  ASSERT_GT(boxes.size(), 4u);
  for (std::size_t i = 0; i < 4; ++i) {
    const Box& wall = boxes[i];
    const Eigen::AlignedBox3d solid(wall.X_WO.translation() - wall.half_m, wall.X_WO.translation() + wall.half_m);
    EXPECT_NEAR(solid.intersection(room.room).volume(), 0.0, 1e-9) << i;
    EXPECT_NEAR(solid.min().z(), 0.5, 1e-12);
    EXPECT_NEAR(solid.max().z(), 4.5, 1e-12);
  }
}

TEST(Furniture, AllOfItIsClearOfTheWayAndOnTheFloor) {
  const Hall room = hall();
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Random random(seed);
    const auto boxes = furnish(room, &random);
    EXPECT_GT(boxes.size(), 15u) << seed;
    double lowest_m = 10;
    for (std::size_t i = 4; i < boxes.size(); ++i) {
      for (int corner = 0; corner < 8; ++corner) {
        const Eigen::Vector3d side((corner & 1) != 0 ? 1 : -1, (corner & 2) != 0 ? 1 : -1, (corner & 4) != 0 ? 1 : -1);
        const Eigen::Vector3d p_W = boxes[i].X_WO * side.cwiseProduct(boxes[i].half_m);
        for (const Eigen::Vector3d& way_W : room.way_W)
          ASSERT_GE((way_W - p_W).head<2>().norm(), room.clear_m - 1e-9) << seed;
        EXPECT_GE(p_W.z(), 0.5 - 1e-9);
        EXPECT_LE(p_W.z(), 4.5 + 1e-9);
        lowest_m = std::min(lowest_m, p_W.z());
      }
    }
    EXPECT_NEAR(lowest_m, 0.5, 1e-9);
  }
}

TEST(Furniture, AWayThatFillsTheRoomLeavesTheWallsAlone) {
  Hall room = hall();
  for (double x = -10; x <= 10; x += 0.5)
    for (double y = -8; y <= 8; y += 0.5) room.way_W.emplace_back(x, y, 2);
  Random random(1);
  EXPECT_EQ(furnish(room, &random).size(), 4u);
}

TEST(Furniture, TheSameStreamGivesTheSameHall) {
  Random a(5), b(5), c(6);
  const auto first = furnish(hall(), &a), second = furnish(hall(), &b), other = furnish(hall(), &c);
  ASSERT_EQ(first.size(), second.size());
  for (std::size_t i = 0; i < first.size(); ++i) EXPECT_EQ(first[i].X_WO.matrix(), second[i].X_WO.matrix());
  EXPECT_NE(first[4].X_WO.matrix(), other[4].X_WO.matrix());
}

}  // namespace
}  // namespace gatefield::scene
