#pragma once

#include <atomic>
#include <chrono>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <string>
#include <thread>

#include "common/geometry/camera.h"
#include "common/scene/depth_camera.h"
#include "gatefield/sdk/publisher.h"
#include "tests/support/dds_domain.h"

namespace gatefield::test {

/// A depth camera's program: what the vehicle's camera sees of a world without noise, 30 times a second, for a bridge
/// on this process's domain. On a thread of its own.
class CameraProgram {
 public:
  static constexpr const char* kTopic = "/camera/depth";

  explicit CameraProgram(const scene::World& world) : renderer_(world), camera_(default_camera()) {
    sdk::PublisherOptions options;
    options.domain = own_domain();
    options.depth = kTopic;
    auto created = sdk::Publisher::create(options);
    if (!created) throw std::runtime_error(created.error());
    publisher_ = std::move(created).value();
    thread_ = std::thread([this] { run(); });
  }
  ~CameraProgram() {
    ending_ = true;
    thread_.join();
  }
  CameraProgram(const CameraProgram&) = delete;
  CameraProgram& operator=(const CameraProgram&) = delete;

  /// Where the vehicle is now. Thread-safe.
  void set_pose(const Eigen::Isometry3d& X_WB) {
    const std::lock_guard lock(mutex_);
    X_WB_ = X_WB;
  }

 private:
  void run() {
    scene::DepthImage image;
    for (auto due = std::chrono::steady_clock::now(); !ending_; due += std::chrono::milliseconds(33)) {
      std::this_thread::sleep_until(due);
      Eigen::Isometry3d X_WB;
      std::chrono::system_clock::time_point exposed;
      {
        const std::lock_guard lock(mutex_);
        X_WB = X_WB_;
        exposed = std::chrono::system_clock::now();
      }
      renderer_.render(camera_, X_WB * Eigen::Isometry3d(camera_.X_BC), &image);
      (void)publisher_->publish_depth(exposed, static_cast<std::uint32_t>(image.width_px),
                                      static_cast<std::uint32_t>(image.height_px), image.depth_m);
    }
  }

  const scene::DepthCamera renderer_;
  const CameraModel camera_;
  std::unique_ptr<sdk::Publisher> publisher_;
  std::mutex mutex_;
  Eigen::Isometry3d X_WB_ = Eigen::Isometry3d::Identity();
  std::atomic<bool> ending_{false};
  std::thread thread_;
};

}  // namespace gatefield::test
