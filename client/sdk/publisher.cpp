#include "gatefield/sdk/publisher.h"

#include <bit>
#include <cstring>
#include <mutex>
#include <utility>

#include "common/dds/ros_endpoint.h"

namespace gatefield::sdk {
namespace {

using dds::RosTopic;

class RosSpeaker final : public Publisher {
 public:
  explicit RosSpeaker(PublisherOptions options) : options_(std::move(options)) {}

  Status open() {
    auto opened = dds::RosPublisher::open(
        options_.domain, options_.name, {.odometry = options_.odometry, .pose = options_.pose, .image = options_.depth},
        options_.network);
    if (!opened) return opened.failure();
    publisher_ = std::move(opened).value();
    return {};
  }

  Status publish_pose(Time measured, const std::string& frame, const Pose& pose) override {
    return send("pose", options_.pose, message(measured, frame, pose));
  }

  Status publish_odometry(Time measured, const std::string& frame, const Pose& pose, const Eigen::Vector3d& v_O,
                          const Eigen::Vector3d& w_B) override {
    ros::Odometry odometry;
    odometry.pose = message(measured, frame, pose);
    odometry.child_frame_id = "base_link";
    odometry.linear = odometry.pose.orientation.conjugate() * v_O;
    odometry.angular = w_B;
    return send("odometry", options_.odometry, odometry);
  }

  Status publish_depth(Time exposed, std::uint32_t width, std::uint32_t height,
                       std::span<const std::uint16_t> millimetres) override {
    return send_image(exposed, width, height, "16UC1", millimetres);
  }
  Status publish_depth(Time exposed, std::uint32_t width, std::uint32_t height,
                       std::span<const float> metres) override {
    return send_image(exposed, width, height, "32FC1", metres);
  }

  std::size_t listeners(const std::string& topic) const override {
    if (topic.empty()) return 0;
    if (topic == options_.odometry) return publisher_->listeners(RosTopic::kOdometry);
    if (topic == options_.pose) return publisher_->listeners(RosTopic::kPose);
    return topic == options_.depth ? publisher_->listeners(RosTopic::kImage) : 0;
  }

 private:
  static ros::PoseStamped message(Time measured, const std::string& frame, const Pose& pose) {
    ros::PoseStamped made;
    made.header = {measured.time_since_epoch(), frame};
    made.position = pose.p_OB;
    made.orientation = Eigen::Quaterniond(pose.q_OB);
    return made;
  }

  template <typename Message>
  Status send(const char* field, const std::string& topic, Message&& message) {
    if (topic.empty()) return Error::invalid(field, "not named", "the topic among the publisher's options");
    if (Status status = ros::validate(message); !status) return status;
    if (publisher_->publish(message)) return {};
    return Error("the bus takes nothing on " + topic + " now", ErrorCode::kNoAnswer, field);
  }

  template <typename Pixel>
  Status send_image(Time exposed, std::uint32_t width, std::uint32_t height, const char* encoding,
                    std::span<const Pixel> pixels) {
    const std::lock_guard lock(mutex_);
    image_.header = {exposed.time_since_epoch(), "camera"};
    image_.width = width;
    image_.height = height;
    image_.step_bytes = width * static_cast<std::uint32_t>(sizeof(Pixel));
    image_.big_endian = std::endian::native == std::endian::big;
    image_.encoding = encoding;
    image_.data.resize(pixels.size_bytes());
    if (!pixels.empty()) std::memcpy(image_.data.data(), pixels.data(), pixels.size_bytes());
    return send("depth", options_.depth, image_);
  }

  const PublisherOptions options_;
  std::unique_ptr<dds::RosPublisher> publisher_;
  std::mutex mutex_;  // of the image
  ros::Image image_;  // kept, so that its memory is
};

}  // namespace

Result<std::unique_ptr<Publisher>> Publisher::create(const PublisherOptions& options) {
  auto publisher = std::make_unique<RosSpeaker>(options);
  if (Status status = publisher->open(); !status) {
    Error error = status.failure();
    if (error.field == "image") return Error::invalid("depth", error.value, error.expected);
    return error;
  }
  return std::unique_ptr<Publisher>(std::move(publisher));
}

}  // namespace gatefield::sdk
