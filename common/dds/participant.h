#pragma once

#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantListener.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>
#include <functional>
#include <memory>
#include <string>
#include <utility>

#include "common/base/result.h"
#include "common/dds/credentials.h"
#include "common/dds/endpoint.h"
#include "common/dds/guarded_transport.h"

/// Inside common/dds only.
namespace gatefield::dds {

ParticipantId id_of(const eprosima::fastrtps::rtps::GuidPrefix_t& prefix) noexcept;

/// Another participant of the domain appeared, changed what it announces, or went (said goodbye or its lease ran out).
struct PeerEvent {
  ParticipantId peer;
  bool gone = false;
  std::string user_data;
};

/// A writer of the domain appeared, or went.
struct WriterEvent {
  std::string topic;
  bool gone = false;
};

/// Moves what open() of a reader or writer gave to `place`, or says why there is none.
template <typename T>
Status keep(Result<std::unique_ptr<T>> opened, std::unique_ptr<T>* place) {
  if (!opened.ok()) return opened.failure();
  *place = std::move(opened).value();
  return {};
}

/// One DDS participant with our transports and all topics. Readers and writers on it must be gone before it goes.
/// Thread-safe: yes.
class Participant final : private eprosima::fastdds::dds::DomainParticipantListener {
 public:
  /// `on_peer` and `on_writer` run on threads of the middleware; they may be called before open() returns.
  /// @param on_writer, admits_fragments  may be empty
  /// @param credentials  of a domain that is closed to strangers; nullptr: it is open
  static Result<std::unique_ptr<Participant>> open(std::uint32_t domain, const std::string& name,
                                                   const std::string& user_data, const TransportOptions& transport,
                                                   std::function<void(const PeerEvent&)> on_peer,
                                                   std::function<void(const WriterEvent&)> on_writer = {},
                                                   AdmitsFragments admits_fragments = {},
                                                   const Credentials* credentials = nullptr);
  /// A discovery server (--discovery-listen) with id 0. Errors: as open(), and a port that is taken.
  static Result<std::unique_ptr<Participant>> open_discovery_server(std::uint32_t domain, std::uint16_t port,
                                                                    const TransportOptions& transport);
  ~Participant() override;

  const TransportOptions& transport() const { return transport_; }
  eprosima::fastdds::dds::DomainParticipant* raw() { return participant_; }

  /// The topic with its type, created at first use. nullptr when the middleware refuses.
  eprosima::fastdds::dds::Topic* topic(const std::string& name, const eprosima::fastdds::dds::TypeSupport& type);

 private:
  Participant(const TransportOptions& transport, std::function<void(const PeerEvent&)> on_peer,
              std::function<void(const WriterEvent&)> on_writer)
      : transport_(transport), on_peer_(std::move(on_peer)), on_writer_(std::move(on_writer)) {}
  /// @param expected  what its absence would explain that the middleware refuses
  Status join(std::uint32_t domain, const eprosima::fastdds::dds::DomainParticipantQos& qos,
              const std::string& expected);
  void on_participant_discovery(eprosima::fastdds::dds::DomainParticipant* participant,
                                eprosima::fastrtps::rtps::ParticipantDiscoveryInfo&& info) override;
  void on_publisher_discovery(eprosima::fastdds::dds::DomainParticipant* participant,
                              eprosima::fastrtps::rtps::WriterDiscoveryInfo&& info) override;

  TransportOptions transport_;
  std::function<void(const PeerEvent&)> on_peer_;
  std::function<void(const WriterEvent&)> on_writer_;
  eprosima::fastdds::dds::DomainParticipant* participant_ = nullptr;
};

}  // namespace gatefield::dds
