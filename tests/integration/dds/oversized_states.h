#pragma once

#include <string>

#include "common/dds/participant.h"
#include "common/dds/qos.h"
#include "gatefield_idl/gatefieldPubSubTypes.h"
#include "tests/integration/dds/raw_type.h"

namespace gatefield::dds {

/// Says states of 1300 bytes, which no state has.
class OversizedStates {
 public:
  OversizedStates(Participant* participant, const std::string& vehicle)
      : publisher_(participant->raw()->create_publisher(eprosima::fastdds::dds::PUBLISHER_QOS_DEFAULT)),
        participant_(participant->raw()) {
    using namespace eprosima::fastdds::dds;
    DataWriterQos qos = writer_qos(Topic::kVehicleState, {});
    qos.endpoint().history_memory_policy = eprosima::fastrtps::rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
    writer_ = publisher_->create_datawriter(
        participant->topic(topic_name(Topic::kVehicleState), TypeSupport(new Raw())), qos);
    key_.vehicle() = vehicle;
    Raw::bytes = {0, 1, 0, 0, static_cast<std::uint8_t>(vehicle.size() + 1), 0, 0, 0};
    Raw::bytes.insert(Raw::bytes.end(), vehicle.begin(), vehicle.end());
    Raw::bytes.resize(1300);
  }
  ~OversizedStates() {
    publisher_->delete_datawriter(writer_);
    participant_->delete_publisher(publisher_);
  }
  OversizedStates(const OversizedStates&) = delete;
  OversizedStates& operator=(const OversizedStates&) = delete;

  int readers() const {
    eprosima::fastdds::dds::PublicationMatchedStatus matched;
    writer_->get_publication_matched_status(matched);
    return matched.current_count;
  }
  void write(int times) const {
    for (int i = 0; i < times; ++i) writer_->write(&key_);
  }

 private:
  using Raw = RawType<wire::VehicleStatePubSubType>;
  eprosima::fastdds::dds::Publisher* const publisher_;
  eprosima::fastdds::dds::DomainParticipant* const participant_;
  eprosima::fastdds::dds::DataWriter* writer_ = nullptr;
  mutable wire::VehicleState key_;  // the library takes it so, and changes nothing
};

}  // namespace gatefield::dds
