#pragma once

#include <Eigen/Core>
#include <chrono>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "common/base/plain.h"
#include "common/base/result.h"
#include "common/dds/network.h"

namespace gatefield::sdk {

struct PublisherOptions {
  std::uint32_t domain = 0;           ///< DDS domain of the bridge, 0 to 232
  std::string name = "publisher";     ///< of this program, for people
  std::string odometry, pose, depth;  ///< topics, as the bridge's file names them ("/mocap/racer/pose"); empty: none
  dds::NetworkOptions network;        ///< as Options::network
};

/// Where a body is. Frames: O is the source's own, z up; B is the body, FLU.
struct Pose {
  Eigen::Vector3d p_OB = Eigen::Vector3d::Zero();      ///< m
  PlainQuaternion q_OB = PlainQuaternion::Identity();  ///< body to O; normalised within 1 %
};

/// For programs that know where a vehicle is (motion capture, VIO) or hold its depth camera: hands that to a
/// gatefield-bridge of the same domain (its sections states and depth), as a ROS 2 node would: nav_msgs/Odometry,
/// geometry_msgs/PoseStamped and sensor_msgs/Image, best effort.
///
/// Times are of the system clock, when it was measured. A bridge on another machine refuses what is more than 10 ms
/// ahead of its own or too old, so keep both machines' clocks together (PTP, chrony).
///
/// Errors: what the bridge would refuse is refused here, kInvalid with the field ("pose.position", "data"); a topic
/// that was not named: kInvalid with "odometry", "pose" or "depth"; kNoAnswer when the middleware takes nothing now,
/// which a later sample may find otherwise.
/// Thread-safe: yes.   Real-time safe: no (system calls).
class Publisher {
 public:
  using Time = std::chrono::system_clock::time_point;

  /// Errors: kInvalid for names and domain; sentences of the middleware.
  static Result<std::unique_ptr<Publisher>> create(const PublisherOptions& options);
  virtual ~Publisher() = default;

  /// @param frame  what O is called (header.frame_id); the bridge may insist on one
  virtual Status publish_pose(Time measured, const std::string& frame, const Pose& pose) = 0;
  /// @param v_O   velocity of the body's origin in the axes of O, m/s
  /// @param w_B   body rates in the axes of B, rad/s
  virtual Status publish_odometry(Time measured, const std::string& frame, const Pose& pose, const Eigen::Vector3d& v_O,
                                  const Eigen::Vector3d& w_B) = 0;
  /// Depth along the optical axis, row-major, width * height pixels of the vehicle file's camera; 0: no return.
  /// @param exposed  middle of the exposure
  virtual Status publish_depth(Time exposed, std::uint32_t width, std::uint32_t height,
                               std::span<const std::uint16_t> millimetres) = 0;
  virtual Status publish_depth(Time exposed, std::uint32_t width, std::uint32_t height,
                               std::span<const float> metres) = 0;

  /// How many programs listen to the topic with this name; 0 for one that was not named.
  virtual std::size_t listeners(const std::string& topic) const = 0;
};

}  // namespace gatefield::sdk
