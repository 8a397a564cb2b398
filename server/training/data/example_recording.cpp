#include "server/training/data/example_recording.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <opencv2/imgcodecs.hpp>
#include <string>

#include "common/base/whole_file.h"
#include "common/geometry/camera.h"
#include "common/scene/depth_camera.h"
#include "common/scene/world.h"
#include "server/training/data/dataset.h"

namespace gatefield::training {
namespace {

namespace fs = std::filesystem;
using Eigen::AngleAxisd;
using Eigen::Isometry3d;
using Eigen::Vector3d;

std::string pose_text(const Isometry3d& X) {
  const Vector3d p = X.translation();
  const Eigen::Quaterniond q(X.linear());
  return fmt::format("{:.9g},{:.9g},{:.9g},{:.9g},{:.9g},{:.9g},{:.9g}", p.x(), p.y(), p.z(), q.w(), q.x(), q.y(),
                     q.z());
}

}  // namespace

Status write_example_recording(const fs::path& folder, int frames) {
  if (frames < 2) return Error{"an example recording of " + std::to_string(frames) + " frames, expected at least 2"};
  std::error_code code;
  fs::create_directories(folder / "depth", code);
  if (code) return Error{"folder " + folder.string() + " can't be made: " + code.message()};

  scene::World world;
  world.floor_z_m = 0.0;
  world.gates.resize(2);
  world.gates[0].X_WG.translation() = Vector3d(5.0, 0.3, 1.4);
  world.gates[0].X_WG.linear() = AngleAxisd(0.35, Vector3d::UnitZ()).toRotationMatrix();
  world.gates[1].X_WG.translation() = Vector3d(9.0, -1.4, 1.6);
  world.gates[1].X_WG.linear() = AngleAxisd(-0.6, Vector3d::UnitZ()).toRotationMatrix();
  scene::Box wall;
  wall.X_WO.translation() = Vector3d(13.0, 0.0, 2.0);
  wall.half_m = Vector3d(0.1, 8.0, 2.0);
  world.boxes.push_back(wall);
  scene::DepthCamera renderer(world);
  const CameraModel camera =
      camera_from_fov(424, 240, 87.0 * std::numbers::pi / 180.0, 58.0 * std::numbers::pi / 180.0);

  const std::string intrinsics = fmt::format(
      "# depth camera; a pixel's centre lies at +0.5 (pixel_center 0: intrinsics of OpenCV, ROS, RealSense)\n"
      "width_px {}\nheight_px {}\nfx_px {:.9g}\nfy_px {:.9g}\ncx_px {:.9g}\ncy_px {:.9g}\ndepth_unit_m 0.001\n"
      "min_depth_m 0.3\nmax_depth_m 10\n",
      camera.width_px, camera.height_px, camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px);
  if (auto status = write_file(folder / "camera.txt", intrinsics); !status) return status;

  std::string gates =
      "p_WG_x,p_WG_y,p_WG_z,q_WG_w,q_WG_x,q_WG_y,q_WG_z,inner_half_m,outer_half_m,thickness_m,opening\n";
  for (const scene::Gate& gate : world.gates) {
    gates += fmt::format("{},{:g},{:g},{:g},square\n", pose_text(gate.X_WG), gate.shape.inner_half_m,
                         gate.shape.outer_half_m, gate.shape.thickness_m);
  }
  if (auto status = write_file(folder / "gates.csv", gates); !status) return status;

  std::string poses = "file,time_s,p_WC_x,p_WC_y,p_WC_z,q_WC_w,q_WC_x,q_WC_y,q_WC_z\n";
  for (int i = 0; i < frames; ++i) {
    const double part = static_cast<double>(i) / (frames - 1);
    Isometry3d X_WB = Isometry3d::Identity();
    X_WB.translation() = Vector3d(3.2 * part, 0.8 * std::sin(2.0 * part) - 0.5, 1.2 + 0.3 * part);
    X_WB.linear() = (AngleAxisd(0.15 - 0.2 * part, Vector3d::UnitZ()) * AngleAxisd(0.25, Vector3d::UnitY()) *
                     AngleAxisd(0.3 * std::sin(4.0 * part), Vector3d::UnitX()))
                        .toRotationMatrix();
    const Isometry3d X_WC = X_WB * dataset_camera().X_BC;
    scene::DepthImage image;
    renderer.render(camera, X_WC, &image);
    cv::Mat depth_mm(camera.height_px, camera.width_px, CV_16UC1);
    for (int v = 0; v < camera.height_px; ++v) {
      for (int u = 0; u < camera.width_px; ++u) {
        const float z_m = image.depth_m[static_cast<std::size_t>(v * camera.width_px + u)];
        depth_mm.at<std::uint16_t>(v, u) = static_cast<std::uint16_t>(z_m * 1000.0f + 0.5f);
      }
    }
    const std::string name = fmt::format("depth/{:06}.png", i);
    bool written = false;
    try {
      written = cv::imwrite((folder / name).string(), depth_mm);
    } catch (const cv::Exception&) {
      written = false;
    }
    if (!written) return Error{"image " + (folder / name).string() + " can't be written"};
    poses += fmt::format("{},{:.6f},{}\n", name, i / 60.0, pose_text(X_WC));
  }
  return write_file(folder / "poses.csv", poses);
}

}  // namespace gatefield::training
