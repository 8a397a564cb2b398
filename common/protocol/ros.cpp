#include "common/protocol/ros.h"

#include <cctype>
#include <cmath>

#include "common/base/text.h"

namespace gatefield::ros {
namespace {

constexpr double kMaxPosition_m = 1e5, kMaxSpeed_m_s = 200.0, kMaxRate_rad_s = 200.0, kUnitTolerance = 0.01;

Status check_stamp(const Header& header) {
  if (header.stamp.count() >= 0) return {};
  return Error::invalid("header.stamp", text(header.stamp.count()) + " ns", "at least 0, since 1970");
}

}  // namespace

Status validate(const PoseStamped& pose) {
  if (Status status = check_stamp(pose.header); !status) return status;
  if (!pose.position.allFinite() || pose.position.cwiseAbs().maxCoeff() > kMaxPosition_m)
    return Error::invalid("pose.position", text(pose.position) + " m", "-100000 to 100000 m each");
  if (!pose.orientation.coeffs().allFinite() || std::abs(pose.orientation.norm() - 1.0) > kUnitTolerance)
    return Error::invalid("pose.orientation", text(pose.orientation.coeffs()), "x, y, z, w of unit length");
  return {};
}

Status validate(const Odometry& odometry) {
  if (Status status = validate(odometry.pose); !status) return status;
  if (!odometry.linear.allFinite() || odometry.linear.norm() > kMaxSpeed_m_s)
    return Error::invalid("twist.linear", text(odometry.linear) + " m/s", "at most 200 m/s");
  if (!odometry.angular.allFinite() || odometry.angular.norm() > kMaxRate_rad_s)
    return Error::invalid("twist.angular", text(odometry.angular) + " rad/s", "at most 200 rad/s");
  return {};
}

Status validate(const Image& image) {
  if (Status status = check_stamp(image.header); !status) return status;
  for (const auto& [field, side] : {std::pair("width", image.width), std::pair("height", image.height)})
    if (side < 1 || side > kMaxImageSide_px)
      return Error::invalid(field, text(side), "1 to " + text(kMaxImageSide_px) + " pixels");
  const std::uint32_t bytes = pixel_bytes(image.encoding);
  if (bytes == 0)
    return Error::invalid("encoding", "'" + shown(image.encoding, 32) + "'",
                          "16UC1, mono16 or 32FC1: publish depth that is not compressed");
  if (image.step_bytes < image.width * bytes)
    return Error::invalid("step", text(image.step_bytes), "at least " + text(image.width * bytes) + " bytes");
  const std::uint64_t expected = std::uint64_t{image.step_bytes} * image.height;
  if (image.data.size() != expected)
    return Error::invalid("data", text(image.data.size()) + " bytes", text(expected) + " bytes, step times height");
  return {};
}

Status validate_topic(const std::string& field, const std::string& name) {
  constexpr std::size_t kMaxLength = 200;
  bool good = name.size() >= 2 && name.size() <= kMaxLength && name.front() == '/' && name.back() != '/';
  for (std::size_t i = 0; good && i < name.size(); ++i) {
    const auto c = static_cast<unsigned char>(name[i]);
    const bool begins = i > 0 && name[i - 1] == '/';
    good = c == '/' ? !begins : std::isalpha(c) != 0 || c == '_' || (std::isdigit(c) != 0 && !begins);
  }
  if (good) return {};
  return Error::invalid(field, "'" + shown(name, kMaxLength) + "'",
                        "a topic's whole name as ros2 topic list shows it, such as \"/mocap/racer/pose\"");
}

std::uint32_t pixel_bytes(const std::string& encoding) noexcept {
  if (encoding == "16UC1" || encoding == "mono16") return 2;
  return encoding == "32FC1" ? 4 : 0;
}

}  // namespace gatefield::ros
