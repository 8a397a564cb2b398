#include "common/scene/depth_camera.h"

#include <gtest/gtest.h>

#include <cmath>
#include <thread>

#include "common/base/random.h"

namespace gatefield::scene {
namespace {

/// A camera at p_W that looks along world x, level.
Eigen::Isometry3d looking_along_x(const Eigen::Vector3d& p_W) { return forward_camera_mount(0.0, p_W); }

World empty_world() {
  World world;
  world.has_floor = false;
  return world;
}

Box wall_at(double x_m, double half_thickness_m = 0.1) {
  Box box;
  box.X_WO.translation() = Eigen::Vector3d(x_m + half_thickness_m, 0, 0);
  box.half_m = Eigen::Vector3d(half_thickness_m, 50, 50);
  box.reflectance = 0.4f;
  return box;
}

float at(const DepthImage& image, int u, int v) {
  return image.depth_m[static_cast<std::size_t>(v * image.width_px + u)];
}

TEST(DepthCamera, WallAheadHasOneDepthInAllPixels) {
  World world = empty_world();
  world.boxes.push_back(wall_at(4.0));
  DepthImage image;
  SurfaceImage surface;
  const CameraModel camera = default_camera();
  DepthCamera(world).render(camera, looking_along_x({0.5, 0, 0}), &image, &surface);
  ASSERT_EQ(image.width_px, 160);
  ASSERT_EQ(image.height_px, 90);
  ASSERT_EQ(image.depth_m.size(), 160u * 90u);
  for (int v = 0; v < 90; ++v) {
    for (int u = 0; u < 160; ++u) {
      ASSERT_NEAR(at(image, u, v), 3.5f, 1e-4f);  // z-depth, not the ray's length
      const auto i = static_cast<std::size_t>(v * 160 + u);
      ASSERT_NEAR(surface.cos_incidence[i], 1.0 / camera.ray_C(u, v).norm(), 1e-5);
      ASSERT_FLOAT_EQ(surface.reflectance[i], 0.4f);
    }
  }
}

TEST(DepthCamera, FloorFollowsTheRayThroughThePixelsCentre) {
  World world;
  world.floor_z_m = -0.5;
  DepthImage image;
  SurfaceImage surface;
  const CameraModel camera = default_camera();
  DepthCamera(world).render(camera, looking_along_x({0, 0, 1.0}), &image, &surface);
  int on_floor = 0;
  for (int v = 0; v < 90; ++v) {
    const double down = camera.ray_C(0, v).y();
    for (int u = 0; u < 160; ++u) {
      const double expected_m = down > 0 ? 1.5 / down : 100.0;
      const bool in_range = expected_m <= camera.max_depth_m;
      ASSERT_NEAR(at(image, u, v), in_range ? expected_m : 0.0, 1e-4) << u << ' ' << v;
      on_floor += in_range ? 1 : 0;
      const auto i = static_cast<std::size_t>(v * 160 + u);
      ASSERT_NEAR(surface.cos_incidence[i], in_range ? down / camera.ray_C(u, v).norm() : 0.0, 1e-5);
    }
  }
  EXPECT_GT(on_floor, 1000);
}

TEST(DepthCamera, SeesThroughTheOpeningAndStopsAtTheFrame) {
  World world = empty_world();
  Gate gate;
  gate.X_WG.translation() = Eigen::Vector3d(3, 0, 0);
  gate.reflectance = 0.9f;
  world.gates.push_back(gate);
  world.boxes.push_back(wall_at(8.0));
  DepthImage image;
  SurfaceImage surface;
  const CameraModel camera = default_camera();
  DepthCamera(world).render(camera, looking_along_x({0, 0, 0}), &image, &surface);
  const double front_m = 3.0 - 0.5 * gate.shape.thickness_m;
  int frame = 0;
  int through = 0;
  for (int v = 0; v < 90; ++v) {
    for (int u = 0; u < 160; ++u) {
      const Eigen::Vector3d at_front = camera.ray_C(u, v) * front_m;
      const Eigen::Vector3d at_back = camera.ray_C(u, v) * (3.0 + 0.5 * gate.shape.thickness_m);
      const double front_edge_m = std::max(std::abs(at_front.x()), std::abs(at_front.y()));
      const double back_edge_m = std::max(std::abs(at_back.x()), std::abs(at_back.y()));
      const auto i = static_cast<std::size_t>(v * 160 + u);
      if (front_edge_m > 0.5 && front_edge_m < 0.75) {
        EXPECT_NEAR(at(image, u, v), front_m, 1e-4);
        EXPECT_FLOAT_EQ(surface.reflectance[i], 0.9f);
        ++frame;
      } else if (back_edge_m < 0.5 || front_edge_m > 0.75) {
        EXPECT_NEAR(at(image, u, v), 8.0, 1e-3);
        ++through;
      }  // else: the inner side of a post, seen at a slant
    }
  }
  EXPECT_GT(frame, 500);
  EXPECT_GT(through, 5000);
}

TEST(DepthCamera, OutsideOfTheRangeNothingComesBack) {
  const CameraModel camera = default_camera();
  DepthImage image;
  const auto middle_with_wall_at = [&](double x_m) {
    World world = empty_world();
    world.boxes.push_back(wall_at(6.0));
    world.boxes.push_back(wall_at(x_m, 0.01));
    DepthCamera(world).render(camera, looking_along_x({0, 0, 0}), &image);
    return at(image, 80, 45);
  };
  EXPECT_EQ(middle_with_wall_at(0.29), 0.0f);  // too near: blocks the view of the wall behind
  EXPECT_NEAR(middle_with_wall_at(0.31), 0.31f, 1e-5f);
  EXPECT_NEAR(middle_with_wall_at(9.0), 6.0f, 1e-4f);

  World far = empty_world();
  far.boxes.push_back(wall_at(9.99));
  DepthCamera(far).render(camera, looking_along_x({0, 0, 0}), &image);
  EXPECT_NEAR(at(image, 80, 45), 9.99f, 1e-3f);
  DepthCamera(far).render(camera, looking_along_x({-0.02, 0, 0}), &image);
  EXPECT_EQ(at(image, 80, 45), 0.0f);
}

TEST(DepthCamera, EmptyWorldGivesAnEmptyImage) {
  DepthImage image;
  SurfaceImage surface;
  DepthCamera(empty_world()).render(default_camera(), looking_along_x({0, 0, 0}), &image, &surface);
  for (const float z : image.depth_m) ASSERT_EQ(z, 0.0f);
  for (const float r : surface.reflectance) ASSERT_EQ(r, 0.0f);
}

TEST(DepthCamera, TurnedBoxAgreesWithTheRaysEntryIntoTheBox) {
  World world = empty_world();
  Box box;
  box.X_WO.linear() =
      (Eigen::AngleAxisd(0.6, Eigen::Vector3d::UnitZ()) * Eigen::AngleAxisd(0.4, Eigen::Vector3d::UnitX()))
          .toRotationMatrix();
  box.X_WO.translation() = Eigen::Vector3d(3, 0.2, -0.1);
  box.half_m = Eigen::Vector3d(0.5, 0.8, 0.6);
  world.boxes.push_back(box);
  // Odd sizes, so that the last tiles are not full.
  CameraModel camera = camera_from_fov(37, 23, 1.2, 0.8);
  DepthImage image;
  SurfaceImage surface;
  const Eigen::Isometry3d X_WC = looking_along_x({0, 0, 0});
  DepthCamera(world).render(camera, X_WC, &image, &surface);
  int hits = 0;
  for (int v = 0; v < 23; ++v) {
    for (int u = 0; u < 37; ++u) {
      // Slab test in the box's own axes; ray parameter = z-depth.
      const Eigen::Vector3d ray_W = X_WC.linear() * camera.ray_C(u, v);
      const Eigen::Vector3d ray_O = box.X_WO.linear().transpose() * ray_W;
      const Eigen::Vector3d start_O = box.X_WO.inverse() * X_WC.translation();
      double enter = -1e9;
      double leave = 1e9;
      int face = 0;
      for (int axis = 0; axis < 3; ++axis) {
        const double a = (-box.half_m[axis] - start_O[axis]) / ray_O[axis];
        const double b = (box.half_m[axis] - start_O[axis]) / ray_O[axis];
        if (std::min(a, b) > enter) {
          enter = std::min(a, b);
          face = axis;
        }
        leave = std::min(leave, std::max(a, b));
      }
      if (std::abs(enter - leave) < 1e-3) continue;  // grazes an edge
      const bool hit = enter < leave && enter > 0;
      ASSERT_NEAR(at(image, u, v), hit ? enter : 0.0, 1e-4) << u << ' ' << v;
      if (!hit) continue;
      ++hits;
      ASSERT_NEAR(surface.cos_incidence[static_cast<std::size_t>(v * 37 + u)], std::abs(ray_O[face]) / ray_O.norm(),
                  1e-4);
    }
  }
  EXPECT_GT(hits, 100);
}

TEST(DepthCamera, ThreadsShareOneCamera) {
  World world;
  world.boxes.push_back(wall_at(5.0));
  world.gates.push_back({});
  world.gates.front().X_WG.translation() = Eigen::Vector3d(2, 0, 1);
  const DepthCamera depth_camera(world);
  const CameraModel camera = default_camera();
  DepthImage expected;
  depth_camera.render(camera, looking_along_x({0, 0, 1}), &expected);
  DepthImage images[2];
  {
    std::jthread first([&] {
      for (int i = 0; i < 20; ++i) depth_camera.render(camera, looking_along_x({0, 0, 1}), &images[0]);
    });
    std::jthread second([&] {
      for (int i = 0; i < 20; ++i) depth_camera.render(camera, looking_along_x({0, 0, 1}), &images[1]);
    });
  }
  EXPECT_EQ(images[0].depth_m, expected.depth_m);
  EXPECT_EQ(images[1].depth_m, expected.depth_m);
}

}  // namespace
}  // namespace gatefield::scene
