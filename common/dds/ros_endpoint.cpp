#include "common/dds/ros_endpoint.h"

#include <cstring>
#include <utility>

#include "common/dds/participant.h"
#include "common/dds/reader.h"
#include "common/dds/ros_convert.h"
#include "common/dds/writer.h"
#include "gatefield_idl/rosPubSubTypes.h"

namespace gatefield::dds {
namespace {

using OdometryType = nav_msgs::msg::dds_::Odometry_PubSubType;
using PoseType = geometry_msgs::msg::dds_::PoseStamped_PubSubType;
using ImageType = sensor_msgs::msg::dds_::Image_PubSubType;

TransportOptions over(const NetworkOptions& network) {
  TransportOptions transport;
  transport.network = network;
  return transport;
}

std::string on_the_wire(const std::string& name) { return "rt" + name; }

std::uint64_t program(const Origin& origin) {
  // The first four bytes are vendor and host; what follows tells the participants of a host apart.
  std::uint64_t number = 0;
  const auto& bytes = origin.participant.bytes;
  std::memcpy(&number, &bytes[bytes.size() - sizeof(number)], sizeof(number));
  return number;
}

/// One topic that is listened to. @tparam Message  what becomes of its samples
template <typename Type, typename Message>
class Ear {
 public:
  using Deliver = std::function<void(Message&, std::uint64_t)>;

  Status open(Participant* participant, RosTopic topic, const std::string& name, RosHandler* handler, Deliver deliver) {
    if (name.empty()) return {};
    typename Reader<Type>::Callbacks callbacks;
    callbacks.sample = [this, topic, handler, deliver = std::move(deliver)](typename Type::type* sample,
                                                                            const Origin& origin) {
      const Status verdict = from_wire(sample, &message_);
      if (verdict.ok())
        deliver(message_, program(origin));
      else
        handler->on_rejected(topic, verdict.failure());
    };
    callbacks.unreadable = [topic, handler] {
      handler->on_rejected(topic, Error("a sample is none of this topic's type", ErrorCode::kUnreadable));
    };
    return keep(Reader<Type>::open(participant, on_the_wire(name), foreign_reader_qos(), std::move(callbacks)),
                &reader_);
  }
  std::size_t publishers() const { return reader_ ? reader_->writers() : 0; }

 private:
  Message message_;  // of the reader's callbacks, which take turns
  std::unique_ptr<Reader<Type>> reader_;
};

class Listener final : public RosListener {
 public:
  Status open(std::uint32_t domain, const std::string& name, const RosTopics& topics, RosHandler* handler,
              const NetworkOptions& network) {
    auto participant = Participant::open(domain, name, {}, over(network), [](const PeerEvent&) {});
    if (auto s = keep(std::move(participant), &participant_); !s) return s;
    if (auto s = odometry_.open(
            participant_.get(), RosTopic::kOdometry, topics.odometry, handler,
            [handler](ros::Odometry& message, std::uint64_t from) { handler->on_odometry(message, from); });
        !s)
      return s;
    if (auto s =
            pose_.open(participant_.get(), RosTopic::kPose, topics.pose, handler,
                       [handler](ros::PoseStamped& message, std::uint64_t from) { handler->on_pose(message, from); });
        !s)
      return s;
    return image_.open(participant_.get(), RosTopic::kImage, topics.image, handler,
                       [handler](ros::Image& message, std::uint64_t from) { handler->on_image(message, from); });
  }

  std::size_t publishers(RosTopic topic) const override {
    if (topic == RosTopic::kOdometry) return odometry_.publishers();
    return topic == RosTopic::kPose ? pose_.publishers() : image_.publishers();
  }

 private:
  std::unique_ptr<Participant> participant_;  // first: readers go before it
  Ear<OdometryType, ros::Odometry> odometry_;
  Ear<PoseType, ros::PoseStamped> pose_;
  Ear<ImageType, ros::Image> image_;
};

template <typename Type>
Status open_writer(Participant* participant, const std::string& name, std::unique_ptr<Writer<Type>>* writer) {
  if (name.empty()) return {};
  return keep(Writer<Type>::open(participant, on_the_wire(name), foreign_writer_qos()), writer);
}

class Publisher final : public RosPublisher {
 public:
  Status open(std::uint32_t domain, const std::string& name, const RosTopics& topics, const NetworkOptions& network) {
    auto participant = Participant::open(domain, name, {}, over(network), [](const PeerEvent&) {});
    if (auto s = keep(std::move(participant), &participant_); !s) return s;
    if (auto s = open_writer(participant_.get(), topics.odometry, &odometry_); !s) return s;
    if (auto s = open_writer(participant_.get(), topics.pose, &pose_); !s) return s;
    return open_writer(participant_.get(), topics.image, &image_);
  }

  bool publish(const ros::Odometry& odometry) noexcept override {
    return odometry_ && odometry_->write([&](auto* sample) { to_wire(odometry, sample); });
  }
  bool publish(const ros::PoseStamped& pose) noexcept override {
    return pose_ && pose_->write([&](auto* sample) { to_wire(pose, sample); });
  }
  bool publish(ros::Image& image) noexcept override {
    return image_ && image_->write(
                         [&](auto* sample) {
                           header_to_wire(image, sample);
                           sample->data().swap(image.data);
                         },
                         [&](auto* sample) { sample->data().swap(image.data); });
  }

  std::size_t listeners(RosTopic topic) const override {
    if (topic == RosTopic::kOdometry) return odometry_ ? odometry_->readers() : 0;
    if (topic == RosTopic::kPose) return pose_ ? pose_->readers() : 0;
    return image_ ? image_->readers() : 0;
  }

 private:
  std::unique_ptr<Participant> participant_;  // first: writers go before it
  std::unique_ptr<Writer<OdometryType>> odometry_;
  std::unique_ptr<Writer<PoseType>> pose_;
  std::unique_ptr<Writer<ImageType>> image_;
};

}  // namespace

Status validate(const RosTopics& topics) {
  for (const auto& [field, name] :
       {std::pair("odometry", &topics.odometry), std::pair("pose", &topics.pose), std::pair("image", &topics.image)})
    if (!name->empty())
      if (Status status = ros::validate_topic(field, *name); !status) return status;
  return {};
}

Result<std::unique_ptr<RosListener>> RosListener::open(std::uint32_t domain, const std::string& name,
                                                       const RosTopics& topics, RosHandler* handler,
                                                       const NetworkOptions& network) {
  if (Status good = validate(topics); !good) return good.failure();
  auto listener = std::make_unique<Listener>();
  if (Status opened = listener->open(domain, name, topics, handler, network); !opened) return opened.failure();
  return std::unique_ptr<RosListener>(std::move(listener));
}

Result<std::unique_ptr<RosPublisher>> RosPublisher::open(std::uint32_t domain, const std::string& name,
                                                         const RosTopics& topics, const NetworkOptions& network) {
  if (Status good = validate(topics); !good) return good.failure();
  auto publisher = std::make_unique<Publisher>();
  if (Status opened = publisher->open(domain, name, topics, network); !opened) return opened.failure();
  return std::unique_ptr<RosPublisher>(std::move(publisher));
}

}  // namespace gatefield::dds
