#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <functional>
#include <memory>
#include <string>
#include <thread>

#include "common/dds/admission.h"
#include "common/dds/participant.h"
#include "common/dds/qos.h"
#include "common/dds/wire_type.h"

/// Inside common/dds only.
namespace gatefield::dds {

struct Origin {
  ParticipantId participant;                            ///< who wrote the sample
  eprosima::fastrtps::rtps::InstanceHandle_t instance;  ///< hash of its key
};

/// A typed reader that hands every sample to a function, one at a time, in one sample object that is used again and
/// again. Nothing that arrives, however malformed, makes it throw.
/// @tparam Type  how samples are read; one that other programs' mistakes can't harm
template <typename Generated, typename Type = WireType<Generated>>
class Reader final : private eprosima::fastdds::dds::DataReaderListener {
 public:
  using Sample = typename Generated::type;
  struct Callbacks {
    std::function<void(Sample* sample, const Origin&)> sample;
    std::function<void(const Origin&)> disposed;  ///< may be empty
    std::function<void()> unreadable;             ///< a sample that is no sample of this type
    Admits admits = {};                           ///< of our own topics; empty: everybody's samples are kept
  };

  static Result<std::unique_ptr<Reader>> open(Participant* participant, Topic topic, Callbacks callbacks,
                                              const std::string& partition = {}) {
    const bool version_first = topic == Topic::kSessionRequest || topic == Topic::kSessionReply;
    return open(participant, topic_name(topic), reader_qos(topic, participant->transport()), std::move(callbacks),
                partition, version_first);
  }

  /// Of a topic that other programs have named.
  static Result<std::unique_ptr<Reader>> open(Participant* participant, const std::string& topic,
                                              const eprosima::fastdds::dds::DataReaderQos& reader_qos,
                                              Callbacks callbacks, const std::string& partition = {},
                                              bool version_first = false) {
    using namespace eprosima::fastdds::dds;
    std::unique_ptr<Reader> self(new Reader(participant, std::move(callbacks)));
    auto* const whole = participant->topic(topic, TypeSupport(new Type()));
    TopicDescription* dds_topic = whole;
    if (whole != nullptr && self->callbacks_.admits) {
      self->admitted_ =
          std::make_unique<AdmittedTopic>(participant->raw(), whole, version_first, self->callbacks_.admits);
      dds_topic = self->admitted_->get();
    }
    SubscriberQos qos = SUBSCRIBER_QOS_DEFAULT;
    if (!partition.empty()) qos.partition().push_back(partition.c_str());
    self->subscriber_ = dds_topic == nullptr ? nullptr : participant->raw()->create_subscriber(qos);
    if (self->subscriber_ != nullptr)
      self->reader_ =
          self->subscriber_->create_datareader(dds_topic, reader_qos, self.get(), StatusMask::data_available());
    if (self->reader_ == nullptr) return Error{"the DDS reader of " + topic + " was refused"};
    return self;
  }

  ~Reader() override {
    if (reader_ != nullptr) {
      reader_->set_listener(nullptr);
      // A callback that runs now ends first. No lock of ours is held meanwhile or in the deletion: a receiving thread
      // comes here with the middleware's own lock, which the deletion wants too.
      for (int i = 0; i < 10000 && arrivals_.load(std::memory_order_acquire) != 0; ++i)
        std::this_thread::sleep_for(std::chrono::microseconds(100));
      subscriber_->delete_datareader(reader_);
    }
    if (subscriber_ != nullptr) participant_->raw()->delete_subscriber(subscriber_);
  }

  /// Writers of this topic and type that are there now.
  std::size_t writers() const {
    eprosima::fastdds::dds::SubscriptionMatchedStatus status;
    reader_->get_subscription_matched_status(status);
    return static_cast<std::size_t>(std::max(0, status.current_count));
  }

 private:
  Reader(Participant* participant, Callbacks callbacks) : participant_(participant), callbacks_(std::move(callbacks)) {}

  /// Each port that is listened to has a thread of its own. Two may be here at the same time, each with locks of the
  /// middleware in hand, so none may wait for the other: the first one takes the samples, those that come meanwhile
  /// only say that there are more.
  void on_data_available(eprosima::fastdds::dds::DataReader* reader) override {
    if (arrivals_.fetch_add(1, std::memory_order_acq_rel) != 0) return;
    for (unsigned seen = 1; seen != 0;) {
      take_all(reader);
      seen = arrivals_.fetch_sub(seen, std::memory_order_acq_rel) - seen;
    }
  }

  void take_all(eprosima::fastdds::dds::DataReader* reader) {
    using namespace eprosima::fastdds::dds;
    // Ends when nothing is left; the bound is for a middleware that would report an error for ever.
    for (int errors = 0; errors < 256;) {
      try {
        SampleInfo info;
        const ReturnCode_t code = reader->take_next_sample(&sample_, &info);
        if (code == ReturnCode_t::RETCODE_NO_DATA) return;
        if (code != ReturnCode_t::RETCODE_OK) {
          ++errors;
          callbacks_.unreadable();
          continue;
        }
        const Origin origin{id_of(info.sample_identity.writer_guid().guidPrefix), info.instance_handle};
        if (info.valid_data) {
          callbacks_.sample(&sample_, origin);
        } else if (info.instance_state == NOT_ALIVE_DISPOSED_INSTANCE_STATE && callbacks_.disposed) {
          callbacks_.disposed(origin);
        }
      } catch (...) {  // out of memory, at the worst: the sample is lost, the program is not
        ++errors;
      }
    }
  }

  Participant* participant_;
  Callbacks callbacks_;
  std::unique_ptr<AdmittedTopic> admitted_;  ///< before the reader, which goes first
  eprosima::fastdds::dds::Subscriber* subscriber_ = nullptr;
  eprosima::fastdds::dds::DataReader* reader_ = nullptr;
  std::atomic<unsigned> arrivals_{0};  ///< calls of on_data_available that are not settled; 0 = nobody takes samples
  Sample sample_;                      ///< of whoever takes samples
};

}  // namespace gatefield::dds
