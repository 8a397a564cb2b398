#pragma once

#include <Eigen/Geometry>
#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

#include "common/base/result.h"

/// What ROS 2 nodes say, as plain structs (idl/ros.idl has their messages): a source of states or of depth images
/// beside the flight controller. Frames are theirs by name; by REP 103 and 105 the world is ENU and a body FLU, as ours
/// are.
namespace gatefield::ros {

struct Header {
  std::chrono::nanoseconds stamp{0};  ///< since 1970, by the sender's system clock; when it was measured
  std::string frame_id;               ///< what the pose is given in, or the camera's frame
};

/// geometry_msgs/PoseStamped.
struct PoseStamped {
  Header header;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();               ///< m
  Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();  ///< child to header.frame_id
};

/// nav_msgs/Odometry, without its covariances.
struct Odometry {
  PoseStamped pose;
  std::string child_frame_id;
  Eigen::Vector3d linear = Eigen::Vector3d::Zero();   ///< m/s, of the child's origin, in the axes of the child
  Eigen::Vector3d angular = Eigen::Vector3d::Zero();  ///< rad/s, in the axes of the child
};

/// sensor_msgs/Image of depth, along the optical axis.
struct Image {
  Header header;
  std::uint32_t width = 0, height = 0;
  std::uint32_t step_bytes = 0;  ///< of a row
  bool big_endian = false;
  std::string encoding;            ///< "16UC1" or "mono16" (millimetres; 0: no return) or "32FC1" (metres; NaN: none)
  std::vector<std::uint8_t> data;  ///< height rows of step_bytes
};

inline constexpr std::uint32_t kMaxImageSide_px = 4096;

/// What can be held against the message itself: all numbers finite, places within 100 km, speeds below 200 m/s and
/// rates below 200 rad/s, quaternions of unit length to 1 %, stamps not before 1970; images of 1 to kMaxImageSide_px on
/// a side, of an encoding that is depth, with rows as long as they are wide at least and exactly their bytes.
/// Thread-safe: yes.   Real-time safe: yes when the message is good (a refusal allocates its sentence).
Status validate(const PoseStamped& pose);
Status validate(const Odometry& odometry);
Status validate(const Image& image);

/// Names of topics as ROS has them: "/" and 1 to 200 of [A-Za-z0-9_/], no part empty or beginning with a digit.
Status validate_topic(const std::string& field, const std::string& name);

/// Bytes of a pixel of this encoding; 0: it is no depth.
std::uint32_t pixel_bytes(const std::string& encoding) noexcept;

}  // namespace gatefield::ros
