#pragma once

#include <cstdint>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/topic/ContentFilteredTopic.hpp>
#include <fastdds/dds/topic/IContentFilter.hpp>
#include <fastdds/dds/topic/IContentFilterFactory.hpp>
#include <functional>
#include <string>
#include <string_view>
#include <utility>

#include "common/dds/guarded_transport.h"
#include "common/dds/participant_id.h"

/// Inside common/dds only.
namespace gatefield::dds {

/// Whether a sample may be kept. Called on receiving threads with the middleware's locks held, for every sample: no
/// waiting, no allocation.
/// @param vehicle  its key; empty: it has none that can be read, or an instance is disposed of
/// @param bytes    of the sample on the wire; 0: an instance is disposed of
using Admits = std::function<bool(std::string_view vehicle, const ParticipantId& from, std::size_t bytes)>;

/// The vehicle's name in a serialized sample of ours: its first field, or the one behind the version. Empty where there
/// is none.
inline std::string_view vehicle_in(const std::uint8_t* sample, std::size_t bytes, bool version_first) noexcept {
  constexpr std::size_t kEncapsulation_bytes = 4;
  std::size_t at = kEncapsulation_bytes + (version_first ? 4 : 0);
  if (bytes < at + 4 || sample[0] != 0) return {};
  std::size_t length = 0;
  for (std::size_t i = 0; i < 4; ++i) length |= std::size_t{sample[at + i]} << 8 * (sample[1] == 1 ? i : 3 - i);
  at += 4;
  if (length < 2 || length > bytes - at) return {};
  return {reinterpret_cast<const char*>(sample) + at, length - 1};
}

/// A topic of which a reader keeps only what is admitted, before a sample takes one of its places for instances, and
/// before ownership decides between writers. On the library's content filters; the wire's topic stays as it is, and
/// writers of ours don't evaluate filters.
/// Must go after its reader. Thread-safe: the filter yes.
class AdmittedTopic final : private eprosima::fastdds::dds::IContentFilterFactory,
                            private eprosima::fastdds::dds::IContentFilter {
 public:
  /// @param topic  of this participant @param version_first  as in vehicle_in()
  AdmittedTopic(eprosima::fastdds::dds::DomainParticipant* participant, eprosima::fastdds::dds::Topic* topic,
                bool version_first, Admits admits)
      : participant_(participant),
        class_("gatefield admission to " + topic->get_name()),
        version_first_(version_first),
        admits_(std::move(admits)) {
    if (participant_->register_content_filter_factory(class_.c_str(), this) == ReturnCode_t::RETCODE_OK)
      topic_ = participant_->create_contentfilteredtopic(topic->get_name() + " admitted", topic, "admitted", {},
                                                         class_.c_str());
  }
  ~AdmittedTopic() {
    if (topic_ != nullptr) participant_->delete_contentfilteredtopic(topic_);
    participant_->unregister_content_filter_factory(class_.c_str());
  }
  AdmittedTopic(const AdmittedTopic&) = delete;
  AdmittedTopic& operator=(const AdmittedTopic&) = delete;

  /// nullptr: the middleware refuses.
  eprosima::fastdds::dds::ContentFilteredTopic* get() const { return topic_; }

 private:
  ReturnCode_t create_content_filter(const char*, const char*, const eprosima::fastdds::dds::TopicDataType*,
                                     const char*, const ParameterSeq&, IContentFilter*& filter) override {
    filter = this;
    return ReturnCode_t::RETCODE_OK;
  }
  ReturnCode_t delete_content_filter(const char*, IContentFilter*) override { return ReturnCode_t::RETCODE_OK; }

  bool evaluate(const SerializedPayload& payload, const FilterSampleInfo&, const GUID_t&) const override {
    // What does not come out of a packet comes from nobody: samples always cross a transport (prepare_process()).
    const ParticipantId* const from = packet_sender();
    if (from == nullptr) return false;
    if (payload.length == 0) return admits_({}, *from, 0);
    return admits_(vehicle_in(payload.data, payload.length, version_first_), *from, payload.length);
  }

  eprosima::fastdds::dds::DomainParticipant* const participant_;
  const std::string class_;
  const bool version_first_;
  const Admits admits_;
  eprosima::fastdds::dds::ContentFilteredTopic* topic_ = nullptr;
};

}  // namespace gatefield::dds
