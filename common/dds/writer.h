#pragma once

#include <algorithm>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <memory>
#include <mutex>
#include <string>

#include "common/dds/participant.h"
#include "common/dds/qos.h"
#include "common/dds/wire_type.h"

/// Inside common/dds only.
namespace gatefield::dds {

/// A typed writer with one sample object that is filled again and again.
/// Thread-safe: yes (writes of one writer take turns).   Does not allocate in this layer once the sample has had its
/// size.
template <typename Generated>
class Writer {
 public:
  using Sample = typename Generated::type;

  static Result<std::unique_ptr<Writer>> open(Participant* participant, Topic topic,
                                              const std::string& partition = {}) {
    return open(participant, topic_name(topic), writer_qos(topic, participant->transport()), partition);
  }

  /// Of a topic that other programs have named.
  static Result<std::unique_ptr<Writer>> open(Participant* participant, const std::string& topic,
                                              const eprosima::fastdds::dds::DataWriterQos& writer_qos,
                                              const std::string& partition = {}) {
    using namespace eprosima::fastdds::dds;
    std::unique_ptr<Writer> self(new Writer(participant));
    auto* dds_topic = participant->topic(topic, TypeSupport(new WireType<Generated>()));
    PublisherQos qos = PUBLISHER_QOS_DEFAULT;
    if (!partition.empty()) qos.partition().push_back(partition.c_str());
    self->publisher_ = dds_topic == nullptr ? nullptr : participant->raw()->create_publisher(qos);
    if (self->publisher_ != nullptr) self->writer_ = self->publisher_->create_datawriter(dds_topic, writer_qos);
    if (self->writer_ == nullptr) return Error{"the DDS writer of " + topic + " was refused"};
    return self;
  }

  ~Writer() {
    if (writer_ != nullptr) publisher_->delete_datawriter(writer_);
    if (publisher_ != nullptr) participant_->raw()->delete_publisher(publisher_);
  }
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;

  /// `fill(Sample*)` fills the sample, which still holds the one before, then it is sent; `after(Sample*)` may take
  /// things back.
  template <typename Fill, typename After>
  bool write(Fill&& fill, After&& after) noexcept {
    const std::lock_guard lock(mutex_);
    try {
      fill(&sample_);
      const bool sent = writer_->write(&sample_);
      after(&sample_);
      return sent;
    } catch (...) {
      return false;
    }
  }
  template <typename Fill>
  bool write(Fill&& fill) noexcept {
    return write(std::forward<Fill>(fill), [](Sample*) {});
  }

  /// Withdraws the vehicle's instance: readers see it disposed, and its slot is free.
  void withdraw(const std::string& vehicle) noexcept {
    const std::lock_guard lock(mutex_);
    try {
      sample_.vehicle() = vehicle;
      writer_->unregister_instance(&sample_, eprosima::fastdds::dds::HANDLE_NIL);
    } catch (...) {  // the middleware ran out of memory; the lease tells the others instead
    }
  }

  /// Readers of this topic and type that are there now.
  std::size_t readers() const {
    eprosima::fastdds::dds::PublicationMatchedStatus status;
    writer_->get_publication_matched_status(status);
    return static_cast<std::size_t>(std::max(0, status.current_count));
  }

  /// Waits until every matched reader has everything, at most `limit_ms`.
  void flush(int limit_ms) {
    writer_->wait_for_acknowledgments(
        eprosima::fastrtps::Duration_t(limit_ms / 1000, static_cast<std::uint32_t>(limit_ms % 1000) * 1'000'000u));
  }

 private:
  explicit Writer(Participant* participant) : participant_(participant) {}

  Participant* participant_;
  eprosima::fastdds::dds::Publisher* publisher_ = nullptr;
  eprosima::fastdds::dds::DataWriter* writer_ = nullptr;
  std::mutex mutex_;
  Sample sample_;
};

}  // namespace gatefield::dds
