#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>

#include "common/base/clock.h"
#include "common/base/result.h"

/// States and depth images that other programs on the bus know (motion capture, VIO, cameras), as ROS 2 nodes publish
/// them or gatefield::sdk::Publisher does.
namespace gatefield::bridge::sources {

struct TimeOptions {
  enum class From {
    kSystemClock,  ///< the message's stamp, by the clock of this machine or one that is kept to it (PTP, chrony)
    kArrival,      ///< when it came, less `delay`: for stamps of other clocks
  };
  From from = From::kSystemClock;
  Stamp delay{0};                                ///< kArrival: from measurement to arrival; 0 to 200 ms
  Stamp oldest{std::chrono::milliseconds(100)};  ///< what is older when it comes is refused; 5 ms to 1 s
};

/// Frames: O is the source's own, W the course's world, both with z up; M is the body that is tracked, B the vehicle's
/// (FLU, in its centre of mass).
struct StateOptions {
  std::string odometry;                                  ///< nav_msgs/Odometry: this topic or the next, not both
  std::string pose;                                      ///< geometry_msgs/PoseStamped
  std::string frame_id;                                  ///< what O has to be called; empty: anything
  Eigen::Vector3d p_WO = Eigen::Vector3d::Zero();        ///< origin of O, m
  double yaw_WO_rad = 0.0;                               ///< turn of O about z
  Eigen::Vector3d p_MB = Eigen::Vector3d::Zero();        ///< centre of mass in M, m; within 1 m
  Eigen::Vector3d rpy_MB_rad = Eigen::Vector3d::Zero();  ///< of B in M: about z by the third, then y, then x
  Stamp velocity_window{std::chrono::milliseconds(30)};  ///< of poses, MotionFilter; 5 to 200 ms
  TimeOptions time;
};

struct DepthOptions {
  std::string image;  ///< sensor_msgs/Image of the session's camera
  TimeOptions time{.oldest = std::chrono::milliseconds(250)};
};

struct Options {
  std::optional<StateOptions> states;
  std::optional<DepthOptions> depth;
};

/// Say which field is wrong and why.
Status validate(const StateOptions& options);
Status validate(const DepthOptions& options);

}  // namespace gatefield::bridge::sources
