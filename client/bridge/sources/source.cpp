#include "client/bridge/sources/source.h"

#include <chrono>

#include "common/base/text.h"

namespace gatefield::bridge::sources {
namespace {

using dds::RosTopic;

const std::string& name(const dds::RosTopics& topics, RosTopic topic) {
  if (topic == RosTopic::kOdometry) return topics.odometry;
  return topic == RosTopic::kPose ? topics.pose : topics.image;
}

const char* type(RosTopic topic) {
  if (topic == RosTopic::kOdometry) return "nav_msgs/msg/Odometry";
  return topic == RosTopic::kPose ? "geometry_msgs/msg/PoseStamped" : "sensor_msgs/msg/Image";
}

std::string line(const std::string& topic, const Admission& admission) {
  return topic + ": " + fixed(admission.rate_hz(), 0) + " a second, " + fixed(1e3 * seconds(admission.age()), 1) +
         " ms old when they come";
}

}  // namespace

Result<std::unique_ptr<Source>> Source::open(const Options& options, const CameraModel& camera, std::uint32_t domain,
                                             const std::string& vehicle, const Clock& clock,
                                             const dds::NetworkOptions& network) {
  std::unique_ptr<Source> source(new Source(options, camera, domain, clock));
  auto listener = dds::RosListener::open(domain, "gatefield-bridge " + vehicle, source->topics_, source.get(), network);
  if (!listener) return listener.failure();
  source->listener_ = std::move(listener).value();
  return source;
}

Source::Source(const Options& options, const CameraModel& camera, std::uint32_t domain, const Clock& clock)
    : domain_(domain), clock_(clock) {
  if (options.states) {
    states_.emplace(*options.states);
    topics_.odometry = options.states->odometry;
    topics_.pose = options.states->pose;
  }
  if (options.depth) {
    depth_.emplace(*options.depth, camera);
    topics_.image = options.depth->image;
  }
}

Moment Source::moment() const noexcept { return {clock_.now(), std::chrono::system_clock::now().time_since_epoch()}; }

void Source::on_odometry(const ros::Odometry& odometry, std::uint64_t program) {
  states_->on_odometry(moment(), odometry, program);
}

void Source::on_pose(const ros::PoseStamped& pose, std::uint64_t program) { states_->on_pose(moment(), pose, program); }

void Source::on_image(ros::Image& image, std::uint64_t program) { depth_->on_image(moment(), image, program); }

void Source::on_rejected(RosTopic topic, const Error& why) {
  if (topic == RosTopic::kImage)
    depth_->on_rejected(why);
  else
    states_->on_rejected(why);
}

bool Source::heard() const noexcept {
  return !(states_ && states_->admission().taken() == 0) && !(depth_ && depth_->admission().taken() == 0);
}

std::vector<std::string> Source::description() const {
  std::vector<std::string> lines;
  if (states_ && states_->admission().taken() > 0) {
    const bool poses = !topics_.pose.empty();
    lines.push_back(
        line(poses ? topics_.pose : topics_.odometry, states_->admission()) +
        (poses ? "; velocity is made of poses and lags by " + fixed(1e3 * seconds(states_->velocity_lag()), 0) + " ms"
               : ""));
  }
  if (depth_ && depth_->admission().taken() > 0) lines.push_back(line(topics_.image, depth_->admission()));
  return lines;
}

std::optional<std::string> Source::complaint(RosTopic topic, const Admission& admission) const {
  if (auto refused = admission.complaint(name(topics_, topic))) return refused->message;
  if (admission.taken() > 0) return std::nullopt;
  const std::size_t publishers = listener_->publishers(topic);
  if (publishers > 0) return name(topics_, topic) + ": its publisher is there and has sent nothing so far; start it";
  return name(topics_, topic) + ": nobody publishes " + type(topic) + " there in domain " + text(domain_) +
         "; compare name and type with ros2 topic info, and session.domain with ROS_DOMAIN_ID";
}

std::vector<std::string> Source::complaints() const {
  std::vector<std::string> sentences;
  const auto add = [&](RosTopic topic, const Admission& admission) {
    if (auto sentence = complaint(topic, admission)) sentences.push_back(std::move(*sentence));
  };
  if (states_) add(topics_.pose.empty() ? RosTopic::kOdometry : RosTopic::kPose, states_->admission());
  if (depth_) add(RosTopic::kImage, depth_->admission());
  return sentences;
}

}  // namespace gatefield::bridge::sources
