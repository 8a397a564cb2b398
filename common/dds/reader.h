#pragma once

#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <functional>
#include <memory>
#include <mutex>
#include <string>

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
template <typename Generated>
class Reader final : private eprosima::fastdds::dds::DataReaderListener {
 public:
  using Sample = typename Generated::type;
  struct Callbacks {
    std::function<void(Sample* sample, const Origin&)> sample;
    std::function<void(const Origin&)> disposed;  ///< may be empty
    std::function<void()> unreadable;             ///< a sample that is no sample of this type
  };

  static Result<std::unique_ptr<Reader>> open(Participant* participant, Topic topic, Callbacks callbacks,
                                              const std::string& partition = {}) {
    using namespace eprosima::fastdds::dds;
    std::unique_ptr<Reader> self(new Reader(participant, std::move(callbacks)));
    auto* dds_topic = participant->topic(topic, TypeSupport(new WireType<Generated>()));
    SubscriberQos qos = SUBSCRIBER_QOS_DEFAULT;
    if (!partition.empty()) qos.partition().push_back(partition.c_str());
    self->subscriber_ = dds_topic == nullptr ? nullptr : participant->raw()->create_subscriber(qos);
    if (self->subscriber_ != nullptr)
      self->reader_ = self->subscriber_->create_datareader(dds_topic, reader_qos(topic, participant->transport()),
                                                           self.get(), StatusMask::data_available());
    if (self->reader_ == nullptr) return Error{std::string("the DDS reader of ") + topic_name(topic) + " was refused"};
    return self;
  }

  ~Reader() override {
    if (reader_ != nullptr) {
      reader_->set_listener(nullptr);
      const std::lock_guard lock(mutex_);  // a callback that runs now ends first
      subscriber_->delete_datareader(reader_);
    }
    if (subscriber_ != nullptr) participant_->raw()->delete_subscriber(subscriber_);
  }

 private:
  Reader(Participant* participant, Callbacks callbacks) : participant_(participant), callbacks_(std::move(callbacks)) {}

  void on_data_available(eprosima::fastdds::dds::DataReader* reader) override {
    using namespace eprosima::fastdds::dds;
    // UDP and shared memory have threads of their own and may be here at the same time.
    const std::lock_guard lock(mutex_);
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
        const Origin origin{info.sample_identity.writer_guid().guidPrefix, info.instance_handle};
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
  eprosima::fastdds::dds::Subscriber* subscriber_ = nullptr;
  eprosima::fastdds::dds::DataReader* reader_ = nullptr;
  std::mutex mutex_;
  Sample sample_;
};

}  // namespace gatefield::dds
