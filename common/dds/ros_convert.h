#pragma once

#include "common/protocol/ros.h"
#include "gatefield_idl/ros.h"

/// Messages of ROS <-> plain structs, inside common/dds only (it shows generated types).
///
/// from_wire converts, checks (ros::validate), then normalises quaternions. It fills `out` as far as it can even when
/// it refuses. Covariances are written as zero ("not known") and not read.
/// Thread-safe: yes.   Real-time safe: yes once `out` has held a message of the same size.
namespace gatefield::dds {

void to_wire(const ros::Odometry& in, nav_msgs::msg::dds_::Odometry_* out);
void to_wire(const ros::PoseStamped& in, geometry_msgs::msg::dds_::PoseStamped_* out);
/// Everything but the data, which callers swap.
void header_to_wire(const ros::Image& in, sensor_msgs::msg::dds_::Image_* out);

Status from_wire(nav_msgs::msg::dds_::Odometry_* in, ros::Odometry* out);
Status from_wire(geometry_msgs::msg::dds_::PoseStamped_* in, ros::PoseStamped* out);
/// Swaps the data out of `in`.
Status from_wire(sensor_msgs::msg::dds_::Image_* in, ros::Image* out);

}  // namespace gatefield::dds
