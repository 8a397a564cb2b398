#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "common/base/result.h"
#include "common/dds/network.h"
#include "common/protocol/ros.h"

namespace gatefield::dds {

/// The topics by their ROS names ("/mocap/racer/odometry"; on the wire "rt" goes before it). Empty: not taken part in.
struct RosTopics {
  std::string odometry;  ///< nav_msgs/Odometry
  std::string pose;      ///< geometry_msgs/PoseStamped
  std::string image;     ///< sensor_msgs/Image
};
enum class RosTopic : std::uint8_t { kOdometry, kPose, kImage };

/// Names out of range are refused (ros::validate_topic()), with fields "odometry", "pose" and "image".
Status validate(const RosTopics& topics);

/// What ROS nodes say. Every message was converted and validated before it gets here; quaternions are normalised.
/// Calls come from threads of the middleware: store and return, never block. Calls for one topic never overlap.
class RosHandler {
 public:
  virtual ~RosHandler() = default;
  /// @param program  who published it: a number for each participant
  virtual void on_odometry(const ros::Odometry& odometry, std::uint64_t program) = 0;
  virtual void on_pose(const ros::PoseStamped& pose, std::uint64_t program) = 0;
  /// The image is the handler's for the call: swap `image.data` with a buffer of your own to take it without a copy.
  virtual void on_image(ros::Image& image, std::uint64_t program) = 0;
  /// A message was dropped.
  virtual void on_rejected(RosTopic topic, const Error& why) = 0;
};

/// Listens to ROS 2 nodes of a domain, best effort.
/// Thread-safe: yes.
class RosListener {
 public:
  /// Errors: kInvalid for names; sentences of the middleware.
  /// @param name  of this participant, for people   @param handler  outlives the listener
  static Result<std::unique_ptr<RosListener>> open(std::uint32_t domain, const std::string& name,
                                                   const RosTopics& topics, RosHandler* handler,
                                                   const NetworkOptions& network = {});
  virtual ~RosListener() = default;
  /// Publishers of the topic, with its type, that are there now. 0 for a topic that is not listened to.
  virtual std::size_t publishers(RosTopic topic) const = 0;
};

/// Publishes as a ROS 2 node would, best effort ("sensor data").
/// Thread-safe: yes.
class RosPublisher {
 public:
  /// Errors: as RosListener::open().
  static Result<std::unique_ptr<RosPublisher>> open(std::uint32_t domain, const std::string& name,
                                                    const RosTopics& topics, const NetworkOptions& network = {});
  virtual ~RosPublisher() = default;
  /// @pre validate() of the message; the topic was named
  /// @return false: the middleware takes nothing now
  virtual bool publish(const ros::Odometry& odometry) noexcept = 0;
  virtual bool publish(const ros::PoseStamped& pose) noexcept = 0;
  /// `image.data` is lent during the call and comes back as it was.
  virtual bool publish(ros::Image& image) noexcept = 0;
  /// Who listens to the topic now.
  virtual std::size_t listeners(RosTopic topic) const = 0;
};

}  // namespace gatefield::dds
