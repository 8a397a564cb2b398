#include "client/bridge/sources/options.h"

#include <chrono>
#include <cmath>
#include <numbers>
#include <utility>

#include "common/base/text.h"
#include "common/protocol/ros.h"

namespace gatefield::bridge::sources {
namespace {

using namespace std::chrono_literals;

std::string milliseconds(Stamp span) { return text(1e3 * seconds(span)) + " ms"; }

Status check_span(const std::string& field, Stamp span, Stamp least, Stamp most) {
  if (span >= least && span <= most) return {};
  return Error::invalid(field, milliseconds(span), milliseconds(least) + " to " + milliseconds(most));
}

Status check_each(const std::string& field, const Eigen::Vector3d& value, double most, const std::string& unit) {
  if (value.allFinite() && value.cwiseAbs().maxCoeff() <= most) return {};
  return Error::invalid(field, text(value) + " " + unit, "-" + text(most) + " to " + text(most) + " " + unit + " each");
}

Status validate(const TimeOptions& time) {
  if (Status status = check_span("time.delay", time.delay, 0ms, 200ms); !status) return status;
  if (time.delay != 0ms && time.from != TimeOptions::From::kArrival)
    return Error::invalid("time.delay", milliseconds(time.delay),
                          "0 where stamps are the message's own, or from: ARRIVAL");
  return check_span("time.oldest", time.oldest, 5ms, 1s);
}

}  // namespace

Status validate(const StateOptions& options) {
  if (options.odometry.empty() == options.pose.empty())
    return Error::invalid("odometry", options.odometry.empty() ? "missing, as is pose" : "given beside pose",
                          "one of the two topics");
  for (const auto& [field, name] : {std::pair("odometry", &options.odometry), std::pair("pose", &options.pose)})
    if (!name->empty())
      if (Status status = ros::validate_topic(field, *name); !status) return status;
  if (Status status = check_each("p_WO", options.p_WO, 1e5, "m"); !status) return status;
  if (!(std::abs(options.yaw_WO_rad) <= 2 * std::numbers::pi))
    return Error::invalid("yaw_WO_rad", text(options.yaw_WO_rad) + " rad", "-2 pi to 2 pi");
  if (Status status = check_each("p_MB", options.p_MB, 1.0, "m"); !status) return status;
  if (Status status = check_each("rpy_MB_rad", options.rpy_MB_rad, 6.2832, "rad"); !status) return status;
  if (Status status = check_span("velocity_window", options.velocity_window, 5ms, 200ms); !status) return status;
  return validate(options.time);
}

Status validate(const DepthOptions& options) {
  if (Status status = ros::validate_topic("image", options.image); !status) return status;
  return validate(options.time);
}

}  // namespace gatefield::bridge::sources
