#include "common/dds/participant.h"

#include <fastdds/dds/domain/DomainParticipantFactory.hpp>

#include "common/dds/qos.h"

namespace gatefield::dds {

using namespace eprosima::fastdds::dds;
using eprosima::fastrtps::rtps::ParticipantDiscoveryInfo;

Result<std::unique_ptr<Participant>> Participant::open(std::uint32_t domain, const std::string& name,
                                                       const std::string& user_data, const TransportOptions& transport,
                                                       std::function<void(const PeerEvent&)> on_peer) {
  if (domain > kMaxDomain)
    return Error{"domain is " + std::to_string(domain) + ", expected 0 to " + std::to_string(kMaxDomain)};
  prepare_process();
  std::unique_ptr<Participant> self(new Participant(transport, std::move(on_peer)));
  try {
    self->participant_ = DomainParticipantFactory::get_instance()->create_participant(
        domain, participant_qos(domain, name, user_data, transport), self.get(), StatusMask::none());
  } catch (const std::exception& problem) {
    return Error{"the DDS participant in domain " + std::to_string(domain) +
                 " could not be created: " + problem.what()};
  }
  if (self->participant_ == nullptr)
    return Error{"the DDS participant in domain " + std::to_string(domain) +
                 " could not be created, expected a network interface that is up (the loopback at least) and free UDP "
                 "ports from " +
                 std::to_string(first_port(domain)) + " on"};
  return self;
}

Participant::~Participant() {
  if (participant_ == nullptr) return;
  participant_->set_listener(nullptr);
  participant_->delete_contained_entities();
  DomainParticipantFactory::get_instance()->delete_participant(participant_);
}

Status Participant::announce(const std::string& user_data) {
  DomainParticipantQos qos = participant_->get_qos();
  qos.user_data().setValue(std::vector<std::uint8_t>(user_data.begin(), user_data.end()));
  if (participant_->set_qos(qos) != ReturnCode_t::RETCODE_OK)
    return Error{"the DDS participant would not announce \"" + user_data + "\""};
  return {};
}

ParticipantId Participant::id() const { return participant_->guid().guidPrefix; }

eprosima::fastdds::dds::Topic* Participant::topic(dds::Topic topic, const TypeSupport& type) {
  if (auto* existing = participant_->lookup_topicdescription(topic_name(topic)))
    return dynamic_cast<eprosima::fastdds::dds::Topic*>(existing);
  if (participant_->register_type(type) != ReturnCode_t::RETCODE_OK) return nullptr;
  return participant_->create_topic(topic_name(topic), type.get_type_name(), TOPIC_QOS_DEFAULT);
}

void Participant::on_participant_discovery(DomainParticipant*, ParticipantDiscoveryInfo&& info) {
  PeerEvent event;
  event.peer = info.info.m_guid.guidPrefix;
  event.gone = info.status == ParticipantDiscoveryInfo::REMOVED_PARTICIPANT ||
               info.status == ParticipantDiscoveryInfo::DROPPED_PARTICIPANT;
  const auto& data = info.info.m_userData;
  event.user_data.assign(data.begin(), data.end());
  on_peer_(event);
}

}  // namespace gatefield::dds
