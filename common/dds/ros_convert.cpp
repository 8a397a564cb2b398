#include "common/dds/ros_convert.h"

#include "common/base/text.h"

namespace gatefield::dds {
namespace {

constexpr std::int64_t kSecond_ns = 1'000'000'000;

void put(const ros::Header& in, std_msgs::msg::dds_::Header_* out) {
  out->stamp().sec(static_cast<std::int32_t>(in.stamp.count() / kSecond_ns));
  out->stamp().nanosec(static_cast<std::uint32_t>(in.stamp.count() % kSecond_ns));
  out->frame_id(in.frame_id);
}

Status take(const std_msgs::msg::dds_::Header_& in, ros::Header* out) {
  out->stamp = std::chrono::nanoseconds(in.stamp().sec() * kSecond_ns + in.stamp().nanosec());
  out->frame_id = in.frame_id();
  if (in.stamp().nanosec() < kSecond_ns) return {};
  return Error::invalid("header.stamp.nanosec", text(in.stamp().nanosec()), "less than 1000000000");
}

template <typename Triple>
void put(const Eigen::Vector3d& in, Triple* out) {
  out->x(in.x());
  out->y(in.y());
  out->z(in.z());
}

template <typename Triple>
Eigen::Vector3d vector(const Triple& in) {
  return {in.x(), in.y(), in.z()};
}

void put(const ros::PoseStamped& in, geometry_msgs::msg::dds_::Pose_* out) {
  put(in.position, &out->position());
  auto& q = out->orientation();
  q.x(in.orientation.x());
  q.y(in.orientation.y());
  q.z(in.orientation.z());
  q.w(in.orientation.w());
}

void take(const geometry_msgs::msg::dds_::Pose_& in, ros::PoseStamped* out) {
  out->position = vector(in.position());
  const auto& q = in.orientation();
  out->orientation = Eigen::Quaterniond(q.w(), q.x(), q.y(), q.z());
}

}  // namespace

void to_wire(const ros::Odometry& in, nav_msgs::msg::dds_::Odometry_* out) {
  put(in.pose.header, &out->header());
  out->child_frame_id(in.child_frame_id);
  put(in.pose, &out->pose().pose());
  put(in.linear, &out->twist().twist().linear());
  put(in.angular, &out->twist().twist().angular());
}

void to_wire(const ros::PoseStamped& in, geometry_msgs::msg::dds_::PoseStamped_* out) {
  put(in.header, &out->header());
  put(in, &out->pose());
}

void header_to_wire(const ros::Image& in, sensor_msgs::msg::dds_::Image_* out) {
  put(in.header, &out->header());
  out->width(in.width);
  out->height(in.height);
  out->encoding(in.encoding);
  out->is_bigendian(in.big_endian ? 1 : 0);
  out->step(in.step_bytes);
}

Status from_wire(nav_msgs::msg::dds_::Odometry_* in, ros::Odometry* out) {
  const Status header = take(in->header(), &out->pose.header);
  out->child_frame_id = in->child_frame_id();
  take(in->pose().pose(), &out->pose);
  out->linear = vector(in->twist().twist().linear());
  out->angular = vector(in->twist().twist().angular());
  if (!header) return header;
  if (Status status = ros::validate(*out); !status) return status;
  out->pose.orientation.normalize();
  return {};
}

Status from_wire(geometry_msgs::msg::dds_::PoseStamped_* in, ros::PoseStamped* out) {
  const Status header = take(in->header(), &out->header);
  take(in->pose(), out);
  if (!header) return header;
  if (Status status = ros::validate(*out); !status) return status;
  out->orientation.normalize();
  return {};
}

Status from_wire(sensor_msgs::msg::dds_::Image_* in, ros::Image* out) {
  const Status header = take(in->header(), &out->header);
  out->width = in->width();
  out->height = in->height();
  out->step_bytes = in->step();
  out->big_endian = in->is_bigendian() != 0;
  out->encoding = in->encoding();
  out->data.swap(in->data());
  if (!header) return header;
  return ros::validate(*out);
}

}  // namespace gatefield::dds
