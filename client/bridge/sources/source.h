#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/bridge/sources/options.h"
#include "client/bridge/sources/outside_depth.h"
#include "client/bridge/sources/outside_states.h"
#include "client/flight/ports.h"
#include "common/base/clock.h"
#include "common/base/result.h"
#include "common/dds/ros_endpoint.h"
#include "common/geometry/camera.h"

namespace gatefield::bridge::sources {

/// What other programs of the domain tell a bridge: states, depth images, or both.
/// Thread-safe: yes; messages come on threads of the middleware, and wait in mailboxes for the ports.
class Source final : private dds::RosHandler {
 public:
  /// @param vehicle  the session's name, for people   @param clock  the loop's; outlives this
  /// Errors: those of dds::RosListener::open().   @pre validate() of the options' parts
  static Result<std::unique_ptr<Source>> open(const Options& options, const CameraModel& camera, std::uint32_t domain,
                                              const std::string& vehicle, const Clock& clock,
                                              const dds::NetworkOptions& network = {});
  ~Source() override { listener_.reset(); }

  /// Null: not among the options.
  flight::StateSource* states() noexcept { return states_ ? &*states_ : nullptr; }
  flight::DepthSource* depth() noexcept { return depth_ ? &*depth_ : nullptr; }

  /// Something good has come on each topic.
  bool heard() const noexcept;
  /// What comes, a line each: rate, age, lag of the velocity.
  std::vector<std::string> description() const;
  /// What keeps it from coming, a sentence each with the next step.
  std::vector<std::string> complaints() const;

 private:
  Source(const Options& options, const CameraModel& camera, std::uint32_t domain, const Clock& clock);
  Moment moment() const noexcept;
  void on_odometry(const ros::Odometry& odometry, std::uint64_t program) override;
  void on_pose(const ros::PoseStamped& pose, std::uint64_t program) override;
  void on_image(ros::Image& image, std::uint64_t program) override;
  void on_rejected(dds::RosTopic topic, const Error& why) override;
  std::optional<std::string> complaint(dds::RosTopic topic, const Admission& admission) const;

  const std::uint32_t domain_;
  const Clock& clock_;
  dds::RosTopics topics_;
  std::optional<OutsideStates> states_;
  std::optional<OutsideDepth> depth_;
  std::unique_ptr<dds::RosListener> listener_;
};

}  // namespace gatefield::bridge::sources
