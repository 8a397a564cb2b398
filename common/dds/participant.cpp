#include "common/dds/participant.h"

#include <algorithm>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <utility>

#include "common/dds/environment.h"
#include "common/dds/qos.h"
#include "common/dds/reach.h"
#include "common/dds/shared_memory.h"

namespace gatefield::dds {

using namespace eprosima::fastdds::dds;
using eprosima::fastrtps::rtps::ParticipantDiscoveryInfo;
using eprosima::fastrtps::rtps::WriterDiscoveryInfo;

namespace {

/// Before anything is opened.
Result<Reach> look_around(std::uint32_t domain, const NetworkOptions& network) {
  if (domain > kMaxDomain)
    return Error{"domain is " + std::to_string(domain) + ", expected 0 to " + std::to_string(kMaxDomain)};
  if (Status status = check_environment(network); !status) return status.failure().within("network.", "network.");
  auto reach = resolve(network);
  if (!reach) return reach.failure().within("network.", "network.");
  if (network.shared_memory) remove_dead_segments();
  prepare_process();
  return reach;
}

}  // namespace

ParticipantId id_of(const eprosima::fastrtps::rtps::GuidPrefix_t& prefix) noexcept {
  ParticipantId id;
  std::copy_n(prefix.value, id.bytes.size(), id.bytes.begin());
  return id;
}

Result<std::unique_ptr<Participant>> Participant::open(std::uint32_t domain, const std::string& name,
                                                       const std::string& user_data, const TransportOptions& transport,
                                                       std::function<void(const PeerEvent&)> on_peer,
                                                       std::function<void(const WriterEvent&)> on_writer,
                                                       AdmitsFragments admits_fragments,
                                                       const Credentials* credentials) {
  const auto reach = look_around(domain, transport.network);
  if (!reach) return reach.failure();
  std::unique_ptr<Participant> self(new Participant(transport, std::move(on_peer), std::move(on_writer)));
  std::string expected = "a network interface that is up (the loopback at least) and free UDP ports from " +
                         std::to_string(first_port(domain)) + " on";
  if (credentials != nullptr)
    expected += ", and " + credentials->certificate.string() + " and the files beside it as gatefield-keys made them";
  Status joined = self->join(
      domain, participant_qos(domain, name, user_data, transport, *reach, std::move(admits_fragments), credentials),
      expected);
  if (!joined) return joined.failure();
  // A library without security ignores that it was asked for.
  if (credentials != nullptr && !bears(id_of(self->participant_->guid().guidPrefix), mark_of(credentials->identity)))
    return Error("the DDS library did not take up security, expected Fast DDS built with its security plugins",
                 ErrorCode::kUnsupported, "network.security");
  return self;
}

Result<std::unique_ptr<Participant>> Participant::open_discovery_server(std::uint32_t domain, std::uint16_t port,
                                                                        const TransportOptions& transport) {
  const auto reach = look_around(domain, transport.network);
  if (!reach) return reach.failure();
  std::unique_ptr<Participant> self(new Participant(transport, [](const PeerEvent&) {}, {}));
  Status joined =
      self->join(domain, discovery_server_qos(port, transport, *reach), "UDP port " + std::to_string(port) + " free");
  if (!joined) return joined.failure();
  return self;
}

Status Participant::join(std::uint32_t domain, const DomainParticipantQos& qos, const std::string& expected) {
  const std::string what = "the DDS participant in domain " + std::to_string(domain) + " could not be created";
  try {
    participant_ = DomainParticipantFactory::get_instance()->create_participant(domain, qos, this, StatusMask::none());
  } catch (const std::exception& problem) {
    return Error{what + ": " + problem.what()};
  }
  if (participant_ == nullptr) return Error{what + ", expected " + expected};
  return {};
}

Participant::~Participant() {
  if (participant_ == nullptr) return;
  participant_->set_listener(nullptr);
  participant_->delete_contained_entities();
  DomainParticipantFactory::get_instance()->delete_participant(participant_);
}

eprosima::fastdds::dds::Topic* Participant::topic(const std::string& name, const TypeSupport& type) {
  if (auto* existing = participant_->lookup_topicdescription(name))
    return dynamic_cast<eprosima::fastdds::dds::Topic*>(existing);
  if (participant_->register_type(type) != ReturnCode_t::RETCODE_OK) return nullptr;
  return participant_->create_topic(name, type.get_type_name(), TOPIC_QOS_DEFAULT);
}

void Participant::on_participant_discovery(DomainParticipant*, ParticipantDiscoveryInfo&& info) {
  PeerEvent event;
  event.peer = id_of(info.info.m_guid.guidPrefix);
  event.gone = info.status == ParticipantDiscoveryInfo::REMOVED_PARTICIPANT ||
               info.status == ParticipantDiscoveryInfo::DROPPED_PARTICIPANT;
  const auto& data = info.info.m_userData;
  event.user_data.assign(data.begin(), data.end());
  on_peer_(event);
}

void Participant::on_publisher_discovery(DomainParticipant*, WriterDiscoveryInfo&& info) {
  if (!on_writer_ || info.status == WriterDiscoveryInfo::CHANGED_QOS_WRITER) return;
  on_writer_({info.info.topicName().to_string(), info.status == WriterDiscoveryInfo::REMOVED_WRITER});
}

}  // namespace gatefield::dds
